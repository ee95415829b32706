"""`python -m persp_sw` is `persp-sw`."""

from .cli import main

if __name__ == "__main__":
    main(prog_name="persp-sw")
