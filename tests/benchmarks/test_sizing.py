from pathlib import Path

from benchmarks import sizing

PAGE = Path(__file__).parents[2] / "docs" / "sizing.md"


def test_the_figures_of_the_sizing_page_are_those_that_its_command_prints():
    assert sizing.tables() in PAGE.read_text()
