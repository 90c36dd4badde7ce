"""The lessons of `fbvm learn` as a course: what a learner has done, and the report about a class."""
