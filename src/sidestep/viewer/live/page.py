"""The page, made of NiceGUI elements around the scene that its own scripts draw."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from sidestep.errors import SidestepError
from sidestep.simulation.record import Record
from sidestep.viewer.animation import animate
from sidestep.viewer.figures import run_figure, save_figure
from sidestep.viewer.live.controls import Controls
from sidestep.viewer.live.visits import Visit, Visits

if TYPE_CHECKING:
    from sidestep.viewer.live.server import Shelf

LARGEST_RECORD = 64 << 20  # bytes, of an uploaded file

KEYS = (
    ("↑ ↓ ← →  or  W A S D", "walk; with Shift hurry"),
    ("drag on the floor", "go where the hand is"),
    ("space", "play, pause"),
    ("n", "one planning step"),
    ("r", "start again"),
    ("f, or hover", "play the prediction forward"),
)
LEGEND = (
    ("heat", "where the person may be"),
    ("band", "plan, and its chance of coming too close"),
    ("keep", "distance to keep"),
    ("gauge", "belief that they give way"),
)


class Page:
    """Builds one page per visitor.

    Args:
        shelf: scenarios and records.
        visits: where visitors are admitted.
    """

    def __init__(self, shelf: Shelf, visits: Visits) -> None:
        self.shelf = shelf
        self.visits = visits

    def register(self) -> None:
        """Make the page reachable at `/`."""
        ui.page("/", dark=None, language="en-US", title="sidestep: be the pedestrian")(self.build)

    def build(self) -> None:
        """Build the page for the visitor who asks for it."""
        token = self.visits.admit()
        visit = None if token is None else self.visits.get(token)
        if token is None or visit is None:
            ui.label("All places are taken at the moment. Please try again in a minute.")
            return
        ui.context.client.on_delete(lambda: self.visits.leave(token))
        ui.add_head_html('<link rel="stylesheet" href="/live/assets/live.css">')
        ui.add_body_html('<script type="module" src="/live/assets/app.js"></script>')
        with ui.element("div").props(f'id=live data-token="{token}"'):
            self._head(visit)
            self._main()
            self._side(visit)

    def _head(self, visit: Visit) -> None:
        with ui.element("header").classes("head"):
            ui.html("<h1>sidestep <small></small></h1>", sanitize=False)
            with ui.element("div").classes("tools"):
                Files(self.shelf, visit).build()
                dark = ui.dark_mode(None)
                button = ui.button(icon="contrast", on_click=lambda: dark.set_value(_next(dark.value)))
                button.props('flat round color=none aria-label="Light, dark, or as the system has it"')
                button.tooltip("Light, dark, or as the system has it")
                help_ = _help()
                ui.button(icon="help_outline", on_click=help_.open).props('flat round color=none aria-label="Help"')

    def _main(self) -> None:
        with ui.element("main").classes("main"):
            ui.element("div").classes("words").props('id=words aria-live="off"')
            ui.element("div").classes("spoken").props('aria-live="polite"')
            ui.element("div").classes("stage")
            with ui.element("div").classes("bar"):
                ui.element("div").classes("transport")
                ui.element("div").classes("measured")

    def _side(self, visit: Visit) -> None:
        with ui.element("aside").classes("side"):
            with ui.element("section").classes("card").props('aria-label="What the robot believes"'):
                ui.element("div").classes("charts")
                entries = "".join(f'<span><i class="{name}"></i>{text}</span>' for name, text in LEGEND)
                ui.html(f'<div class="legend">{entries}</div>', sanitize=False)
            with ui.element("div").classes("adjust"):
                Controls(self.shelf.scenarios, visit).build()
            ui.element("section").classes("card outcome").props('aria-label="What came of it"')


class Files:
    """Record, picture and film out; record in.

    Args:
        shelf: reads and writes records.
        visit: whose trips they are.
    """

    def __init__(self, shelf: Shelf, visit: Visit) -> None:
        self.shelf = shelf
        self.visit = visit

    def build(self) -> None:
        """Make the buttons and the menu."""
        upload = ui.upload(auto_upload=True, max_file_size=LARGEST_RECORD, max_files=1, on_upload=self._opened)
        upload.props('accept=".npz"').style("display: none")
        self.back = ui.button("Back to live", icon="directions_walk", on_click=lambda: self._show(None))
        self.back.props("flat no-caps color=none").set_visibility(not self.visit.live)
        with ui.button(icon="save_alt").props('flat round color=none aria-label="Keep, open, look back"') as button:
            button.tooltip("Keep, open, look back")
            with ui.menu():
                ui.menu_item("Look back at this trip", self._look_back)
                ui.menu_item("Open a record…", lambda: upload.run_method("pickFiles"))
                ui.separator()
                ui.menu_item("Keep the record (.npz)", lambda: self._keep(".npz"))
                ui.menu_item("Keep a picture (.png)", lambda: self._keep(".png"))
                ui.menu_item("Keep a film (.mp4)", lambda: self._keep(".mp4"))
                ui.menu_item("Keep a film (.gif)", lambda: self._keep(".gif"))

    def _show(self, record: Record | None) -> None:
        self.visit.show(record)
        self.back.set_visibility(record is not None)

    def _look_back(self) -> None:
        record = self._record()
        if record is not None:
            self._show(record)

    def _record(self) -> Record | None:
        try:
            return self.visit.record()
        except (SidestepError, ValueError) as error:
            ui.notify(str(error), type="warning")
            return None

    async def _opened(self, event: Any) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "opened.npz"
            path.write_bytes(await event.file.read())
            try:
                record = await run.io_bound(self.shelf.read_record, path)
                if record is not None:
                    self._show(record)
            except SidestepError as error:
                ui.notify(
                    f"{event.file.name}: {error}".replace(str(path), "this file"), type="negative", multi_line=True
                )
        event.sender.reset()

    async def _keep(self, suffix: str) -> None:
        record = self._record()
        if record is None:
            return
        note = ui.notification("Drawing…", spinner=True, timeout=None) if suffix != ".npz" else None
        try:
            content = await run.io_bound(written, record, suffix, self.shelf.write_record)
            if content is not None:  # None: the server is going down
                ui.download.content(content, f"sidestep-{record.scenario}{suffix}")
        except SidestepError as error:
            ui.notify(str(error), type="negative", multi_line=True)
        finally:
            if note is not None:
                note.dismiss()


def written(record: Record, suffix: str, write_record: Callable[[Record, Path], Path]) -> bytes:
    """Return `record` as the content of a file: `.npz`, `.png`, `.mp4` or `.gif`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"record{suffix}"
        if suffix == ".npz":
            write_record(record, path)
        elif suffix == ".png":
            save_figure(run_figure(record), path)
        else:
            animate(record, path)
        return path.read_bytes()


def _help() -> ui.dialog:
    with ui.dialog() as dialog, ui.card().style("max-width: 480px"):
        ui.html("<h2 style='font-size:18px;margin:0'>Be the pedestrian</h2>", sanitize=False)
        ui.label(
            "The robot wants to get to the double ring. It does not know whether you will give way, and learns it from "
            "what you do: walk into its way and keep going, or step aside, and watch what it believes."
        )
        rows = "".join(f"<tr><td><b>{keys}</b></td><td>{what}</td></tr>" for keys, what in KEYS)
        ui.html(f"<table id='keys' style='border-spacing:12px 4px;font-size:14px'>{rows}</table>", sanitize=False)
        ui.button("Close", on_click=dialog.close).props("flat no-caps color=none")
    return dialog


def _next(mode: bool | None) -> bool | None:
    return {None: True, True: False, False: None}[mode]
