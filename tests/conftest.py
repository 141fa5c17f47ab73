"""Settings of the tests as a whole."""

import pytest

pytest_plugins = ["ladder"]

# FFCx opens the C file it writes without closing it (fixed upstream in later releases).
FFCX_LEAVES_A_FILE_OPEN = (
    r"ignore:Exception ignored in. <_io.FileIO name=.*libffcx_:pytest.PytestUnraisableExceptionWarning"
)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("filterwarnings", FFCX_LEAVES_A_FILE_OPEN)
