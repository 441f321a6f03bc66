"""The acceleration that weighs everybody."""

GRAVITY_M_S2 = 9.80665  # standard gravity (CGPM 1901)
