"""bsip: body segment inertial parameters from motion capture and force plates."""

__version__ = "0.1.0"
