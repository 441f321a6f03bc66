"""configs/default.toml is the manual: every option is there, explained and checked."""

from __future__ import annotations

import tomllib

import pytest
from pydantic import BaseModel

from bsip_cli.config import Config, load_config, shipped
from bsip_cli.reference import option_texts, schema_of

OPTIONS = {f"{o.section}.{o.name}".lstrip("."): o for o in option_texts()}


def flat(values: dict, prefix: str = "") -> dict:
    found = {}
    for name, value in values.items():
        inner = isinstance(value, dict) and value  # an empty table is an option of its own
        found |= flat(value, f"{name}.") if inner else {f"{prefix}{name}": value}
    return found


def fields(model: type[BaseModel], prefix: str = "") -> set[str]:
    names = set()
    for name, field in model.model_fields.items():
        inner = field.annotation
        is_section = isinstance(inner, type) and issubclass(inner, BaseModel)
        names |= fields(inner, f"{name}.") if is_section else {f"{prefix}{name}"}
    return names


def test_every_option_is_in_the_file_and_checked():
    defaults = flat(tomllib.loads(shipped("default.toml").read_text(encoding="utf-8")))
    assert set(defaults) == fields(Config) == set(OPTIONS)


@pytest.mark.parametrize("name", OPTIONS)
def test_every_option_is_explained_and_has_its_default_in_the_file_alone(name):
    option = OPTIONS[name]
    assert len(option.comment) > 15, "say what it is, its unit and why"
    assert option.name in schema_of(option.section)["required"]


def test_later_files_override_single_options(tmp_path):
    first, second = tmp_path / "study.toml", tmp_path / "own.toml"
    first.write_text("[stats]\nalpha = 0.1\nequivalence_percent = 5.0\n")
    second.write_text("[stats]\nalpha = 0.01\n")
    config = load_config([first, tmp_path / "absent.toml", second])
    assert config.stats.alpha == 0.01
    assert config.stats.equivalence_percent == 5.0
    assert config.ik == load_config([]).ik


def test_options_for_provenance_are_only_those_asked_for():
    config = load_config([])
    assert config.options(("regress", "skeleton")) == {
        "regress": {"table": "dumas2007"},
        "skeleton": "hansen2017",
    }
