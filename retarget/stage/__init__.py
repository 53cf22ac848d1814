"""The stage: a dance as a page in the browser, live or as one file. The one room that knows viser."""

from retarget.stage.file import save_page
from retarget.stage.lanes import inset
from retarget.stage.page import Page, Panel, close_server, open_server
from retarget.stage.show import Figure, Lane, Row, Show, show_reference, show_retargeting, show_side_by_side

__all__ = [
    "Figure",
    "Lane",
    "Page",
    "Panel",
    "Row",
    "Show",
    "close_server",
    "inset",
    "open_server",
    "save_page",
    "show_reference",
    "show_retargeting",
    "show_side_by_side",
]
