"""The methods of every comparison, by their names in artifacts, tables and reports."""

MEASURED = "measured"
RM = "RM"  # the table's parameters
RM_MASS = "RM+mass"  # RM, all masses and tensors times one number
OM = "OM"  # identified

ALTERNATIVES = (RM, RM_MASS)
"""What OM is compared with: what one number for the whole mass does, identification did not."""

METHODS = (*ALTERNATIVES, OM)

SAME_WITHIN = 0.01  # errors that differ by less count as equal


def is_extended(method: str) -> bool:
    """OM with causes that the diagnosis named in the model: ``OM+<effect>``."""
    return method.startswith(f"{OM}+")
