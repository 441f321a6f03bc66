"""Persons as a sum: what they share is found, and what is one person's own is not blamed on it."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.laboratory import (
    Persons,
    alike_in,
    persons_of,
    posterior_of,
    scales_of,
    sums_of,
)
from bsip_cli.diagnosis.laboratory_search import (
    Laboratory,
    causes_of,
    deviations_of,
    laboratory_of,
    verdicts_of,
)
from bsip_cli.diagnosis.shared_faults import (
    OF_A_LABORATORY,
    STATED_MASS,
    Coordinate,
    Information,
    with_known,
)
from bsip_cli.effects.plates import PlateRotation
from tests.diagnosis.noisy_trial import errors_of, late, noisy
from tests.effects.moving_scene import moving

CENTRES_M = {"1": np.array([0.2, 0.3, 0.0]), "2": np.array([0.2, -0.3, 0.0])}
ODDS, NAMED = 0.1, 0.95
BETWEEN = 0.2  # deviations from person to person [typical]
MOMENTS_S = (1.0, 0.3)  # mean and standard deviation
ALIKE = 0.15  # share of one person's variance
DELAY = Coordinate("sync_offset", "", "delay")
VERTICAL = Coordinate("plate_gain", "1 fz", "gain")
VERTICAL_TYPICAL = 0.04
MASS = Coordinate(STATED_MASS.name, "", "share")


def numbers() -> dict:
    """Every number of the shared faults of two plates."""
    scene, found = moving(), {}
    for effect in (*OF_A_LABORATORY, STATED_MASS):
        for target in effect.targets(scene):
            if not target.startswith("all"):
                for parameter in effect.parameters(scene, target):
                    found[Coordinate(effect.name, target, parameter.name)] = parameter
    return found


def drawn(
    rng: np.random.Generator,
    hidden: dict,
    count: int,
    between: float = BETWEEN,
    known: dict | None = None,
) -> list[Information]:
    """What persons tell who all have the hidden sizes [typical] and deviations of their own; each
    tells some directions well and others hardly."""
    known = numbers() if known is None else known
    coordinates = tuple(known)
    truth = np.array([hidden.get(one, 0.0) for one in coordinates])
    found = []
    for _ in range(count):
        root = rng.standard_normal((len(truth), len(truth))) * rng.uniform(0.1, 2.0, len(truth))
        precision = root @ root.T
        own = truth + between * rng.standard_normal(len(truth))
        own[coordinates.index(MASS)] = truth[coordinates.index(MASS)]
        pull = precision @ own + root @ rng.standard_normal(len(truth))
        trials = np.full(len(truth), 2)
        found.append(Information(coordinates, tuple(known.values()), trials, precision, pull))
    return found


def together(told: list[Information], alike: float = 0.0) -> Persons:
    return persons_of(told, [0.008] * len(told), BETWEEN, alike, MOMENTS_S)


def fitted(told: list[Information], alike: float = 0.0) -> Laboratory:
    persons = together(told, alike)
    return laboratory_of(persons, causes_of(persons, CENTRES_M), ODDS)


def verdict(lab: Laboratory, effect: str, target: str):
    found = verdicts_of(lab, NAMED, np.random.default_rng(0))
    return next(v for v in found if (v.cause.effect, v.cause.target) == (effect, target))


def test_a_delay_that_all_share_is_named_with_its_size():
    lab = fitted(drawn(np.random.default_rng(1), {DELAY: 1.0}, 8))
    found = verdict(lab, "sync_offset", "")
    (size,) = found.sizes
    assert found.said == "named"
    assert size.low < 0.010 < size.high
    assert size.high - size.low < 0.006
    assert size.limit < 0.010


def test_intervals_hold_as_often_as_they_say():
    inside = []
    for seed in range(40):
        lab = fitted(drawn(np.random.default_rng(seed), {DELAY: 1.0}, 6))
        k = [one.effect for one in lab.causes].index(DELAY.effect)
        (size,) = lab.sizes(k, NAMED, np.random.default_rng(0))
        inside.append(size.low < 0.010 < size.high)
    assert 0.85 <= np.mean(inside) <= 1.0


def test_of_two_similar_faults_one_is_named_only_where_persons_agree_which():
    """Eight show a gain or a zero, and all together the gain, also where each other person does
    not: those who do might as well have been fewer."""
    gain, zero = VERTICAL, Coordinate("plate_zero", "1 fz", "offset")
    parameters = tuple(numbers()[one] for one in (gain, zero))
    both, apart = np.array([1.0, 1.0]), np.array([1.0, -1.0])
    precision = 20 * np.outer(both, both) + np.outer(apart, apart)
    for scatter, said in ((0.0, ("named", "rejected")), (1.0, ("ambiguous", "ambiguous"))):
        told = []
        for sign in (1, -1) * 4:
            pull = 20 * both + (0.5 + sign * scatter) * apart
            told.append(Information((gain, zero), parameters, np.full(2, 2), precision, pull))
        first, second = verdicts_of(fitted(told), NAMED, np.random.default_rng(0))
        assert (first.cause.effect, first.said, second.said) == (gain.effect, *said)
        # as large as the one, if it is in its place
        assert second.sizes[0].low > 0 or second.said == "rejected"


def test_nothing_is_named_where_nothing_is():
    names = []
    for seed in range(40):
        lab = fitted(drawn(np.random.default_rng(100 + seed), {}, 5))
        names += [lab.causes[k].effect for k in lab.found]
        names += [
            one.cause.effect
            for one in deviations_of(lab, ODDS, NAMED, [], np.random.default_rng(0))
        ]
    assert len(names) <= 2


def test_a_fault_in_motion_alone_is_found_beside_those_who_stand_still_without():
    """And no other fault is made of the contradiction; where it is in both, it is found too."""
    known = numbers()
    twice = known | {replace(x, standing=True): p for x, p in known.items() if x != MASS}
    standing = replace(VERTICAL, standing=True)
    for hidden in ({VERTICAL: 1.5}, {VERTICAL: 1.5, standing: 1.5}):
        lab = fitted(drawn(np.random.default_rng(12), hidden, 12, known=twice))
        assert [(lab.causes[k].effect, lab.causes[k].target) for k in lab.found] == [
            ("plate_gain", "1 fz")
        ]
        (size,) = verdict(lab, "plate_gain", "1 fz").sizes
        assert size.low < 0.06 < size.high


def test_deviations_follow_from_the_persons():
    few, many = (
        scales_of(together(drawn(np.random.default_rng(3), {}, 12, between)))
        for between in (0.05, 0.8)
    )
    assert np.median((many / few)[: len(many) // 2]) > 2


def test_persons_are_a_sum():
    persons = together(drawn(np.random.default_rng(4), {DELAY: 1.0}, 70))
    scale = np.ones(persons.count)
    whole = sums_of(persons, scale)
    parts = sums_of(persons, scale, range(2)) + sums_of(persons, scale, range(2, 70))
    assert np.allclose(whole.precision, parts.precision)
    assert np.allclose(whole.pull, parts.pull)
    assert whole.log_factor == pytest.approx(parts.log_factor)


def test_what_the_others_tell_is_the_sum_less_the_own():
    told = drawn(np.random.default_rng(9), {DELAY: 1.0}, 6)
    lab = fitted(told)
    less = lab.pooled().without([told[2]])
    others = sums_of(lab.persons, lab.scale, [0, 1, 3, 4, 5])
    assert np.allclose(less.precision, others.precision, atol=1e-9)
    assert np.allclose(less.pull, others.pull, atol=1e-9)
    mine = lab.persons.coordinates.index(DELAY)
    assert less.posterior().covariance[mine, mine] > lab.posterior().covariance[mine, mine]


def test_what_is_known_of_the_clock_is_no_residual_any_more():
    """And what is not known of it stays as a term of that size."""
    scene = late(noisy(moving(), 1), 0.01)
    trial = errors_of(scene)
    known = with_known(trial, False, (DELAY,), np.array([1.0]), np.array([[0.05]]))
    before, after = ((x.residual**2).mean(axis=0)[:3] for x in (trial, known))
    assert (after < 0.2 * before).all()
    (term,) = (x for x in known.terms if x.term == "fault:laboratory")
    slope = (known.residual - trial.residual)[..., None]
    assert np.allclose(term.of_unit_variance, -0.05 * slope)
    assert not any(x.term == "fault:sync_offset" for x in known.terms)


def test_no_memory_but_what_is_kept_grows_with_the_persons():
    peaks = []
    for count in (100, 500):
        persons = together(drawn(np.random.default_rng(13), {}, 1) * count)
        scale = np.ones(persons.count)
        tracemalloc.start()
        scales_of(persons)
        sums_of(persons, scale)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


@pytest.mark.parametrize("number", [DELAY, VERTICAL])
def test_what_all_persons_have_alike_is_no_fault_of_the_laboratory(number):
    """Two milliseconds or 0.8 % in everybody, of however many persons; else it would be named."""
    told = drawn(np.random.default_rng(10), {number: 0.2}, 40, 0.02)
    for alike, expected in ((0.0, True), (ALIKE, False)):
        lab = fitted(told, alike)
        assert any(lab.causes[k].effect == number.effect for k in lab.found) == expected


def test_what_is_alike_is_a_share_of_what_one_person_has():
    """However many there are, and whoever tells nothing of a plate."""
    (one,) = drawn(np.random.default_rng(14), {}, 1)
    second = np.array([x.target.startswith("2") for x in one.coordinates])
    apart = replace(one, precision=one.precision * (second == second[:, None]))
    of_first = replace(apart, precision=apart.precision * ~second)
    persons = together([apart])
    moving = [k for k, x in enumerate(persons.coordinates) if x != MASS]
    known = sums_of(persons, np.ones(persons.count)).precision
    expected = ALIKE * np.linalg.inv(known[np.ix_(moving, moving)])
    lag = np.array([x.effect in ("sync_offset", "clock_drift") for x in persons.coordinates])
    for told in ([apart], [apart] * 50, [apart] * 4 + [of_first] * 9):
        root = alike_in(together(told, ALIKE))
        covariance = (root @ root.T)[np.ix_(moving, moving)]
        plates = ~lag[moving]
        assert np.allclose(covariance[plates][:, plates], expected[plates][:, plates])
        assert (np.diag(covariance)[~plates] > np.diag(expected)[~plates]).all()
        assert np.allclose(root[~np.isin(np.arange(len(root)), moving)], 0.0)


def test_what_is_told_by_who_stands_still_alone_is_told():
    known = {replace(x, standing=x == VERTICAL): p for x, p in numbers().items()}
    standing = replace(VERTICAL, standing=True)
    lab = fitted(drawn(np.random.default_rng(17), {standing: 1.5}, 12, known=known), ALIKE)
    assert np.isfinite(lab.alike).all()
    (size,) = verdict(lab, "plate_gain", "1 fz").sizes
    assert size.low < 1.5 * VERTICAL_TYPICAL < size.high


def test_early_and_late_a_body_may_lag_otherwise_as_persons_do():
    """And no clock's rate is made of it, by however many persons."""
    rate = Coordinate("clock_drift", "", "rate_error")
    persons = together(drawn(np.random.default_rng(15), {}, 1), ALIKE)
    at = [persons.coordinates.index(x) for x in (DELAY, rate)]
    typical = np.array([persons.parameters[k].typical for k in at])
    column = alike_in(persons)[at, -1] * typical
    late_s = [column @ [1.0, MOMENTS_S[0] + n * MOMENTS_S[1]] for n in (-1, 0, 1)]
    usual_s = np.sqrt(ALIKE) * BETWEEN * typical[0]
    assert np.allclose(late_s, [-usual_s, 0.0, usual_s])


def test_intervals_hold_what_all_persons_have_alike():
    """In whatever direction; without the share they miss it in most laboratories of many."""
    inside = {0.0: 0, ALIKE: 0}
    for seed in range(10):
        rng = np.random.default_rng(300 + seed)
        told = drawn(rng, {DELAY: 1.0, VERTICAL: 1.0}, 24)
        persons = together(told, ALIKE)
        root = alike_in(persons)
        same = root @ rng.standard_normal(root.shape[1])
        at = [persons.coordinates.index(x) for x in told[0].coordinates]
        told = [replace(x, pull=x.pull + x.precision @ same[at]) for x in told]
        for alike in inside:
            lab = fitted(told, alike)
            k = [(x.effect, x.target) for x in lab.causes].index((VERTICAL.effect, VERTICAL.target))
            (size,) = lab.sizes(k, NAMED, rng)
            inside[alike] += size.low < VERTICAL_TYPICAL < size.high
    assert inside[ALIKE] >= 9
    assert inside[0.0] <= 7


def test_the_sums_are_those_of_all_deviations_at_once():
    """With every person's deviation a coefficient of its own, the posterior is the same."""
    told = drawn(np.random.default_rng(5), {DELAY: 1.0}, 3)
    persons = together(told)
    root = np.diag(persons.ordinary + 1.0)
    short = posterior_of(sums_of(persons, np.ones(persons.count)), root)
    count = len(persons.ordinary)
    whole = np.zeros((4 * count, 4 * count))
    against = np.zeros(4 * count)
    whole[:count, :count] = np.diag(1 / np.diag(root) ** 2)
    for k in range(3):
        mine, own = slice((k + 1) * count, (k + 2) * count), persons.precision[k]
        whole[:count, :count] += own
        whole[:count, mine], whole[mine, :count] = own, own
        whole[mine, mine] = own + np.diag(1 / persons.usual[k] ** 2)
        against[:count] += persons.pull[k]
        against[mine] = persons.pull[k]
    inverse = np.linalg.inv(whole)
    assert np.allclose(short.mean, (inverse @ against)[:count], atol=1e-8)
    assert np.allclose(short.covariance, inverse[:count, :count], atol=1e-8)


def test_a_stated_mass_that_is_wrong_is_the_persons_and_no_plates():
    rng = np.random.default_rng(6)
    told = drawn(rng, {}, 7) + drawn(rng, {MASS: 6.0}, 1)
    lab = fitted(told)
    assert not lab.found
    (one,) = deviations_of(lab, ODDS, NAMED, [], rng)
    assert (one.sessions, one.cause.effect, one.said) == ((7,), "stated_mass", "named")
    (size,) = one.sizes
    assert size.low < 0.06 < size.high


def test_a_plate_that_reads_otherwise_in_one_session_is_found_there():
    rng = np.random.default_rng(7)
    told = drawn(rng, {}, 3) + drawn(rng, {VERTICAL: 3.0}, 1) + drawn(rng, {}, 4)
    (one,) = deviations_of(fitted(told), ODDS, NAMED, [], rng)
    assert (one.sessions, one.cause.effect, one.cause.target) == ((3,), "plate_gain", "1 fz")


def test_a_change_that_lasts_is_dated():
    rng = np.random.default_rng(8)
    told = drawn(rng, {}, 6) + drawn(rng, {DELAY: 1.5}, 6)
    found = deviations_of(fitted(told), ODDS, NAMED, list(range(12)), rng)
    lasting = [one for one in found if len(one.sessions) > 1]
    best = max(lasting, key=lambda one: one.probability)
    assert best.cause.effect == "sync_offset"
    assert best.sessions == tuple(range(6, 12))


def test_all_plates_turned_are_each_turned_and_shifted():
    """The directions of one turn about the middle of the plates are what the effect does."""
    scene = moving()
    known = numbers()
    coordinates = tuple(known)
    parameters = tuple(known.values())
    empty = np.zeros((len(known), len(known)))
    told = Information(coordinates, parameters, np.ones(len(known)), empty, empty[0])
    centres = {plate.name: plate.centre_m() for plate in scene.plates}
    persons = together([told])
    causes = causes_of(persons, centres)
    cause = next(c for c in causes if (c.effect, c.target) == (PlateRotation.name, "all"))
    effects = {effect.name: effect for effect in OF_A_LABORATORY}
    for k, parameter in enumerate(cause.parameters):
        turned = np.zeros(3)
        turned[k] = 1.0
        whole = PlateRotation().tangent(scene, "all", np.zeros(3)) @ turned * parameter.typical
        parts = np.zeros_like(whole)
        for one, p, size in zip(
            persons.coordinates, persons.parameters, cause.directions[:, k], strict=True
        ):
            if size:
                effect = effects[one.effect]
                names = [x.name for x in effect.parameters(scene, one.target)]
                tangent = effect.tangent(scene, one.target, np.zeros(len(names)))
                parts += size * p.typical * tangent[..., names.index(one.parameter)]
        assert np.allclose(whole, parts, atol=1e-4 * np.abs(whole).max())
