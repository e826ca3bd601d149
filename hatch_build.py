"""The build hook: puts the built web client into the package, for wheels, editable installs and source archives alike.

Set CATHXR_SKIP_WEB=1 to leave the client out (the package then works, but serves no page).
"""

import os
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).resolve().parent / "tools"))
import web_client


class WebClientHook(BuildHookInterface):
    """Builds web/ into src/cathxr/web_client where that is missing or older than its sources."""

    def dependencies(self) -> list[str]:
        """Return the package that brings Node.js, only where it is needed and the machine has none."""
        if _skipped() or web_client.find_node() is not None:
            return []
        try:
            needed = not web_client.is_fresh(Path(self.root))
        except web_client.WebClientError:
            needed = False  # the build itself says what is wrong
        return [web_client.NODE_PACKAGE] if needed else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the client, or end with one sentence that says why not."""
        if _skipped():
            self.app.display_warning("CATHXR_SKIP_WEB is set: the package is built without its web page.")
            return
        try:
            web_client.build(Path(self.root))
        except web_client.WebClientError as error:
            self.app.abort(str(error))


def _skipped() -> bool:
    return os.environ.get("CATHXR_SKIP_WEB", "") not in ("", "0")
