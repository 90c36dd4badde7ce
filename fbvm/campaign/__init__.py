"""Many runs of one project: mutants of its programs, tried against its tests by processes of this machine."""
