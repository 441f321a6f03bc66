"""What is no artifact, and who may write into a folder."""

from __future__ import annotations

import pytest

from bsip_cli.errors import UsageError
from bsip_cli.running.runner import held_alone


@pytest.mark.parametrize("content", [None, b"no artifact"])
def test_info_of_something_else_is_refused(content, bsip, tmp_path):
    path = tmp_path / "x.parquet"
    if content is not None:
        path.write_bytes(content)
    answer = bsip("info", path)
    assert answer.code == 3
    assert "x.parquet" in answer.err
    assert "Traceback" not in answer.err


def test_an_error_of_the_work_itself_stays_what_it_is(tmp_path):
    with pytest.raises(FileNotFoundError, match="a bug"), held_alone(tmp_path / "sub-01"):
        raise FileNotFoundError("a bug")


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be written"), held_alone(tmp_path / "file" / "x"):
        pass
