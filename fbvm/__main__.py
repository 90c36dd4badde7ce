"""The command `fbvm`, and `python -m fbvm`."""

from typing import NoReturn

from fbvm.cli.shared.ending import loading, run_process


def _verb() -> None:
    with loading():
        from fbvm.cli.main import main
    main()


def main() -> NoReturn:
    """Runs the command line.  Raises SystemExit."""
    run_process(_verb)


if __name__ == "__main__":
    main()
