"""bsip: body segment inertial parameters from motion capture and force plates."""

__version__ = "0.2.0"

_LIBRARY = ("Person", "Plate", "read", "recording")
__all__ = ["__version__", *_LIBRARY]


def __getattr__(name: str) -> object:
    """What `bsip_cli.library` gives, loaded when it is asked for: the command line needs none."""
    if name in _LIBRARY:
        from importlib import import_module

        return getattr(import_module("bsip_cli.library"), name)
    raise AttributeError(f"module 'bsip_cli' has no attribute '{name}'")
