import pytest

from sidestep.thesis.reproduce import Settings, reproduce


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """The whole report, reduced."""
    return reproduce(tmp_path_factory.mktemp("report"), settings=Settings(quick=True))
