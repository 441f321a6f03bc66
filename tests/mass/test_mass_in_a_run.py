"""From recording to `regress`: a mass that is stated, in the file, on the plates, or nowhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bsip_cli.commands.show import shown
from bsip_cli.running.runner import Outcome
from bsip_cli.simulate.options import Laboratory
from bsip_cli.simulate.study import participant_person, simulate_study
from bsip_cli.stages.person_mass import StatedMass, stated_mass
from tests.small_study import Run, small

OPTIONS = replace(small("F", 11, static=1.5, squat=3.0), laboratory=Laboratory(plate_per_foot=True))
STATIC, SQUAT = "sub-01_task-static", "sub-01_task-squat_run-1"
CASES = Path(__file__).parents[2].parent / "shared" / "cases"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> MassRun:
    run = MassRun.within(tmp_path_factory.mktemp("mass"))
    simulate_study(run.study, OPTIONS)
    return run


TRUE_KG = participant_person(OPTIONS, 1).mass_kg


class MassRun(Run):
    def state(self, mass: object, ingest: str = "") -> None:
        """Write what participants.tsv says, and options of ingest."""
        header = "participant_id\tsex\tmass_kg\theight_m\n"
        (self.study / "participants.tsv").write_text(f"{header}sub-01\tF\t{mass}\t1.65\n")
        (self.study / "study.toml").write_text(f'marker_set = "hansen2017"\n[ingest]\n{ingest}\n')

    def ingest(self, *stems: str) -> list[Outcome]:
        """The session first, then these trials."""
        assert self.perform("ingest").state == "done"
        done = [self.perform("ingest", stem) for stem in stems]
        assert [one.state for one in done] == ["done"] * len(stems)
        return done

    def until_scale(self, *stems: str) -> Outcome:
        self.ingest(*(stems or (STATIC, SQUAT)))
        done = self.perform("scale")
        assert done.state == "done"
        return done


@pytest.fixture
def run(recorded, tmp_path) -> MassRun:
    return recorded.copied_to(tmp_path)


@pytest.mark.parametrize("trials", [(STATIC,), (SQUAT,), (STATIC, SQUAT)])
def test_without_a_stated_mass_the_plates_tell_it_and_that_is_said(run, trials):
    run.state("n/a")
    done = run.until_scale(*trials)
    person = run.read("person").iloc[0]
    assert person["mass_source"] == "plates" and person["mass_note"] == ""
    assert person["mass_kg"] == pytest.approx(TRUE_KG, rel=0.01)
    assert any("mass taken from the plates" in sentence for sentence in done.sentences)


@pytest.mark.parametrize("plates", ['plates = ["9"]', "plates = [1]", "plates = [2]"])
def test_where_nothing_tells_the_mass_kinematics_are_made_and_regress_waits(run, plates):
    """No plate; or a plate under one foot, the other beside it."""
    run.state("n/a", plates.replace('"', ""))
    done = run.until_scale()
    assert "mass is not known: put mass_kg into participants.tsv, because" in done.sentences[0]
    person = run.read("person").iloc[0]
    assert np.isnan(person["mass_kg"]) and person["mass_source"] == "unknown"
    assert run.perform("ik", STATIC).state == "done"
    refused = run.perform("regress")
    assert refused.state == "refused"
    (sentence,) = refused.sentences
    assert "put mass_kg into participants.tsv, because" in sentence
    assert "mass is not known" in next(iter(shown(run.out)))


@pytest.mark.parametrize(
    ("stated", "likely"),
    [
        (f"{2.20462 * TRUE_KG:.1f}", "pounds"),
        (f"{TRUE_KG / 2.20462:.1f}", "2.2046"),
        ("164", "the height in cm"),
    ],
)
def test_a_wrong_unit_is_the_first_line_and_no_seat(run, stated, likely):
    run.state(stated)
    first = run.ingest(STATIC, SQUAT)[0].sentences[0]
    done = run.perform("scale")
    for sentence in (first, done.sentences[0]):
        assert "do not agree" in sentence and likely in sentence
        assert f"{stated} kg" in sentence
    for stem in (STATIC, SQUAT):
        assert not run.read("quality", stem)["found"].str.contains("seat").any()
        assert run.read("contacts", stem)["valid"].mean() > 0.9
    person = run.read("person").iloc[0]
    assert person["mass_kg"] == pytest.approx(TRUE_KG, rel=0.01)
    assert "do not agree" in next(iter(shown(run.out)))


def test_a_gross_difference_without_a_known_mistake_keeps_the_stated_mass(run):
    run.state(f"{1.3 * TRUE_KG:.1f}")
    done = run.until_scale()
    assert "second person or a load" in done.sentences[0]
    assert run.read("person").iloc[0]["mass_kg"] == pytest.approx(1.3 * TRUE_KG, abs=0.06)


def test_a_small_difference_is_a_warning_and_the_stated_mass_stays(run):
    run.state(f"{1.06 * TRUE_KG:.1f}")
    done = run.until_scale()
    assert any("tolerance 2 %" in sentence for sentence in done.sentences)
    person = run.read("person").iloc[0]
    assert person["mass_source"] == "participants.tsv" and person["mass_note"] == ""


def test_the_recordings_own_entry_comes_after_the_table_and_before_the_plates(run):
    unit = run.unit("scale")
    facts = ({}, {"stated_mass_kg": None}, {"stated_mass_kg": 61.5})
    assert stated_mass(unit, *facts).mass_kg == participant_in_table(run)
    run.state("n/a")
    unit = run.unit("scale")
    assert stated_mass(unit, *facts) == StatedMass(61.5, "the recording's own entry")
    assert stated_mass(unit, {}) is None


def participant_in_table(run: Run) -> float:
    return pd.read_csv(run.study / "participants.tsv", sep="\t")["mass_kg"].iloc[0]


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases (shared/cases) are not here")
def test_pounds_in_participants_tsv(bsip, tmp_path):
    study = CASES / "15g-mass-lb" / "study"
    answer = bsip("ingest", study, "--out", tmp_path / "out")
    first = answer.err.splitlines()[0]
    assert "110.9 kg" in first and "50.27 kg" in first and "pounds" in first
    answer = bsip("scale", study, "--out", tmp_path / "out")
    assert answer.code == 0 and "do not agree" in answer.err.splitlines()[0]
    assert "seat" not in answer.err
