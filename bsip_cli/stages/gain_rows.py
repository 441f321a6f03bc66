"""The gain of an extended model as rows of the gain artifacts."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.diagnosis.error_gain import BlockErrors, error_gain
from bsip_cli.stages.reconstructed import scale_of


def gain_rows(errors: dict[str, BlockErrors], method: str, data: str, seed: int) -> pd.DataFrame:
    """A row per component; ``errors`` in the units that people read."""
    rng = np.random.default_rng(seed)
    rows = []
    for component, one in errors.items():
        gain = error_gain(one, rng)
        rows.append(
            {
                "component": component,
                "method": method,
                "rmse_before": gain.rmse_before,
                "rmse_after": gain.rmse_after,
                "unit": scale_of(component)[1],
                "gain_percent": gain.percent,
                "ci_low": gain.ci_low,
                "ci_high": gain.ci_high,
                "data": data,
            }
        )
    return pd.DataFrame(rows)
