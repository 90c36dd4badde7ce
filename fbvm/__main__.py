"""`python -m fbvm`: the same as the command `fbvm`."""

from fbvm.cli.main import main

if __name__ == "__main__":
    main()
