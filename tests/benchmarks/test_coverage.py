from benchmarks.coverage import by_folder


def counted(statements: int, covered: int) -> dict:
    return {"summary": {"num_statements": statements, "covered_lines": covered}}


def test_folders_below_a_folder_count_with_it():
    files = {
        "bsip_cli/cli.py": counted(10, 10),
        "bsip_cli/report/first_page.py": counted(30, 15),
        "bsip_cli/report/cohort/record.py": counted(10, 5),
    }
    assert by_folder(files) == [
        ("bsip_cli", 10, 100.0),
        ("bsip_cli/report", 40, 50.0),
        ("all", 50, 60.0),
    ]


def test_a_folder_without_statements_is_reached_as_a_whole():
    assert by_folder({"bsip_cli/study/__init__.py": counted(0, 0)})[0][2] == 100.0
