"""A plate's zero from its unloaded stretches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.recordings.model import Plate
from bsip_cli.recordings.plate_wrench import plate_zero, subtract_zero

RATE_HZ = 1000.0
OFFSET = np.array([3.0, -2.0, 12.0, 0.5, -0.4, 0.1])


def _plate(load_N: np.ndarray) -> Plate:
    noise = np.random.default_rng(2).normal(0, 1.0, (len(load_N), 6))
    wrench = OFFSET + noise
    wrench[:, 2] += load_N
    return Plate("1", wrench[:, :3], wrench[:, 3:], None, np.ones(len(load_N), bool))


def test_offset_is_found_and_subtracted():
    load = np.zeros(4000)
    load[1000:3000] = 700 * np.sin(np.linspace(0, np.pi, 2000))
    plate = _plate(load)
    zero = plate_zero(plate, RATE_HZ)
    assert 1500 < zero.n_samples < 2100 and len(zero.stretches_s) == 2
    np.testing.assert_allclose(zero.offset, OFFSET, atol=0.3)
    corrected, finding = subtract_zero(plate, zero)
    assert finding.level == "corrected"
    assert abs(np.median(corrected.force_N[:900, 2])) < 0.3


def test_zeros_that_software_wrote_are_no_reading():
    load = np.zeros(4000)
    load[1000:3000] = 700 * np.sin(np.linspace(0, np.pi, 2000))
    plate = _plate(load)
    silent = load == 0
    force, moment = plate.force_N.copy(), plate.moment_Nm.copy()
    force[silent] = moment[silent] = 0.0
    plate = replace(plate, force_N=force, moment_Nm=moment)
    zero = plate_zero(plate, RATE_HZ)
    assert not zero.is_known()
    assert subtract_zero(plate, zero)[1].found.startswith("exactly 0 without load")


def test_zeros_that_do_not_last_are_noise_about_a_threshold():
    """Software sets to 0 what is below 9 N; the plate reads 12 N with noise of 5 N."""
    plate = _plate(np.random.default_rng(5).normal(0, 5.0, 4000))
    low = np.abs(plate.force_N[:, 2]) < 9
    assert 0.15 < low.mean() < 0.5
    force, moment = (np.where(low[:, None], 0.0, x) for x in (plate.force_N, plate.moment_Nm))
    zero = plate_zero(replace(plate, force_N=force, moment_Nm=moment), RATE_HZ)
    assert zero.n_samples > 3500
    np.testing.assert_allclose(zero.offset[:3], OFFSET[:3], atol=2.5)


def test_a_plate_that_is_never_unloaded_keeps_its_zero():
    plate = _plate(np.full(3000, 350.0))
    zero = plate_zero(plate, RATE_HZ)
    assert not zero.is_known()
    same, finding = subtract_zero(plate, zero)
    assert same is plate and finding.level == "info"
