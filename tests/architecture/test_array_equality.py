"""Dataclasses that hold arrays are compared by identity: the truth of arrays' equality is none."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Callable, Iterator
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pandas as pd
import pyarrow as pa

from tests.architecture.imports_of import modules

# What annotations name and Python cannot evaluate: imports for the type checker, array[float].
FOR_TYPES_ONLY = {"Level": str, "Figure": object, "Table": object, "array": list}
ARRAYS = (np.ndarray, pd.DataFrame, pd.Series, pa.Table)


def test_dataclasses_that_hold_arrays_have_no_equality():
    holders = {one for name in modules() for one in dataclasses_of(name) if holds_arrays(one)}
    assert len(holders) > 100
    assert sorted(str(one) for one in holders if one.__eq__ is not object.__eq__) == []


def dataclasses_of(module: str) -> Iterator[type]:
    name = "bsip_cli" if module == "__init__" else f"bsip_cli.{module}"
    for _, one in inspect.getmembers(importlib.import_module(name), inspect.isclass):
        if dataclasses.is_dataclass(one) and one.__module__ == name:
            yield one


def holds_arrays(one: type) -> bool:
    hints = get_type_hints(one, localns=FOR_TYPES_ONLY)
    return any(names_arrays(hints[field.name]) for field in dataclasses.fields(one))


def names_arrays(hint: Any) -> bool:
    is_array = inspect.isclass(hint) and issubclass(hint, ARRAYS)
    parts = () if get_origin(hint) is Callable else get_args(hint)
    return is_array or any(map(names_arrays, parts))
