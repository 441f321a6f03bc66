"""``python -m bsip_cli``: the same as the command ``bsip``."""

from bsip_cli.cli import main

if __name__ == "__main__":
    main()
