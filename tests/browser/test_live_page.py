"""Other promises of the page: keyboard alone, phone, dark, side by side, records, several visitors, no strangers."""

from __future__ import annotations

import time
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest

from conftest import RESULTS, Server
from sidestep.io.records import read_record


def _choose(tab, setting, option):
    tab.page.locator(f"[data-setting={setting}]").first.click()
    tab.page.get_by_role("option", name=option).click()
    tab.page.wait_for_function("document.activeElement.id === 'scene'")  # and the keys walk again


def test_a_newcomer_sees_the_robot_move_and_is_told_who_they_are(visit):
    tab = visit()
    assert tab.page.get_by_text("You are the person.").is_visible()
    start = tab.panel()["robot"]
    tab.until("f.time > 1.5")
    assert tab.panel()["robot"] != start
    tab.picture("first-sight")


def test_nothing_comes_from_another_machine(visit, server):
    tab = visit()
    tab.until("f.time > 1")
    hosts = {urlsplit(url).netloc for url in tab.requests if not url.startswith(("data:", "blob:"))}
    assert hosts == {urlsplit(server.address).netloc}


def test_a_name_that_points_here_from_elsewhere_gets_nothing(server):
    request = urllib.request.Request(server.address, headers={"Host": "elsewhere.example"})
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request, timeout=20)
    assert refused.value.code == 400
    refused.value.close()


def test_keyboard_alone(visit):
    tab = visit()
    page = tab.page
    page.keyboard.press("Space")
    tab.until("!f.running")
    stopped = tab.time()
    page.keyboard.press("n")
    tab.until(f"f.time > {stopped + 0.15}")
    page.keyboard.press("Space")
    tab.until("f.running")
    for _ in range(40):  # by Tab to the scene
        if page.evaluate("document.activeElement.id") == "scene":
            break
        page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "scene"
    page.keyboard.down("ArrowUp")
    tab.until("p.people[0][1] > 0.8")
    page.keyboard.up("ArrowUp")
    tab.picture("keyboard-focus")
    page.keyboard.press("f")
    assert page.locator("[data-name=look]").get_attribute("aria-pressed") == "true"
    page.keyboard.press("f")
    for _ in range(60):  # and on to a slider, where arrows belong to the slider
        if page.evaluate("document.activeElement.closest('[data-setting=horizon]') !== null"):
            break
        page.keyboard.press("Tab")
    before = tab.panel()["people"][0]
    page.keyboard.press("ArrowLeft")
    page.wait_for_function("window.sidestep.world.horizon === 7")
    assert tab.panel()["people"][0][:2] == pytest.approx(before[:2], abs=0.3)
    page.keyboard.press("Escape")


def test_every_control_has_a_name(visit):
    tab = visit()
    unnamed = tab.page.evaluate(
        """() => [...document.querySelectorAll('button, input:not([type=file]), [role=slider], canvas')]
        .filter((e) => e.offsetParent && !e.closest('[aria-label]') && !e.innerText?.trim())
        .map((e) => e.outerHTML.slice(0, 160))"""
    )
    assert unnamed == []


def test_hovering_plays_the_prediction_forward(visit):
    tab = visit()
    tab.until("f.time > 0.5")
    tab.page.mouse.move(*tab.on_screen(-4.8, 0.2))
    tab.page.wait_for_function("window.sidestep.scene.looking")
    tab.page.wait_for_timeout(1500)
    tab.picture("hovering")
    tab.page.mouse.move(*tab.on_screen(4.8, 4.8))
    tab.page.wait_for_function("!window.sidestep.scene.looking")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("name", "width", "height", "touch"), [("phone", 390, 844, True), ("desk", 1360, 850, False)])
def test_every_size_and_scheme(visit, name, width, height, touch, scheme):
    tab = visit(width=width, height=height, touch=touch, scheme=scheme)
    tab.until("f.time > 1.5")
    if touch:
        tab.page.touchscreen.tap(*tab.on_screen(-3.0, -1.0))
    tab.page.keyboard.down("ArrowRight")
    tab.until("p.distance < 3.0 || p.status === 'arrived'")
    tab.page.keyboard.up("ArrowRight")
    tab.picture(f"{name}-{scheme}")
    assert tab.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert tab.page.locator("#words").bounding_box()["width"] <= width
    background = tab.page.evaluate("getComputedStyle(document.body).backgroundColor")
    darkness = sum(int(c) for c in background[4:-1].split(",")[:3])
    assert (darkness < 200) == (scheme == "dark")
    if touch:
        tab.page.evaluate("document.querySelector('.adjust').scrollIntoView()")
        tab.picture(f"{name}-{scheme}-controls")


def test_a_finger_drags_the_person(visit):
    tab = visit(width=390, height=844, touch=True)
    session = tab.page.context.new_cdp_session(tab.page)
    x, y = tab.on_screen(-5.0, 0.0)
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    for k in range(25):
        u, v = tab.on_screen(-5.0 + 0.1 * k, 2.0)
        session.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": u, "y": v}]})
        tab.page.wait_for_timeout(40)
    tab.until("p.people[0][1] > 1.2")
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    tab.until("f.hand === null")
    assert tab.page.evaluate("window.scrollY") == 0


@pytest.mark.parametrize(("option", "title"), [("constant-velocity MPC", "constant-velocity MPC"), ("ORCA", "ORCA")])
def test_side_by_side_with_another_planner(visit, option, title):
    tab = visit()
    _choose(tab, "beside", option)
    tab.until("f.panels.length === 2", seconds=90)
    tab.page.keyboard.down("ArrowRight")
    tab.until("f.time > 5.5")
    tab.page.keyboard.up("ArrowRight")
    tab.picture(f"beside-{option.split()[0].lower()}")
    one, two = tab.panels()
    assert one["people"][0] == two["people"][0]
    assert tab.page.locator("#words p").count() == 2
    assert title in tab.page.locator("#words").inner_text()


def test_what_the_robot_ignores_shows(visit):
    tab = visit()
    _choose(tab, "ignores", "that some do not give way")
    tab.page.wait_for_function("window.sidestep.world.panels[0].title === 'trusts everybody'")
    tab.page.keyboard.down("ArrowRight")
    tab.until("p.distance < 2.5")
    tab.page.keyboard.up("ArrowRight")
    tab.picture("trusts-everybody")
    assert tab.panel()["beliefs"][0] > 0.99


def test_simulated_people_share_the_floor(visit):
    tab = visit()
    tab.page.locator("[data-setting=people] [tabindex]").first.focus()
    for _ in range(6):
        tab.page.keyboard.press("ArrowRight")
    tab.until("p.people.length === 7")
    start = tab.time()
    tab.until(f"f.time > {start + 3}")
    tab.picture("six-others")
    assert tab.page.locator("[data-setting=people]").get_attribute("aria-valuenow") == "6"
    assert tab.panel()["contacts"][0] == 0


@pytest.mark.parametrize("name", ["office", "doorway", "blind-corner", "crowd"])
def test_walls_and_crowds_of_scenarios(visit, name):
    tab = visit()
    _choose(tab, "scenario", name)
    tab.page.wait_for_function(f"window.sidestep.world.name === '{name}'")
    tab.until("f.time > 3", seconds=120)
    tab.picture(f"scenario-{name}")
    assert tab.panel()["contacts"][0] == 0


def test_a_map_file_of_ros_is_walked_in(browser, visit, tmp_path):
    """A scenario of one's own whose walls are a map_server file; a wall stops the visitor."""
    cells = np.full((60, 80), 254, dtype=np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = cells[20:40, 38:42] = 0
    (tmp_path / "room.pgm").write_bytes(b"P5 80 60 255\n" + cells.tobytes())
    (tmp_path / "room.yaml").write_text(
        "image: room.pgm\nresolution: 0.1\norigin: [-4, -3, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "room.toml").write_text(
        'map = "room.yaml"\n[robot]\nstart = [-3.0, 0.0]\ngoal = [3.0, 0.0]\n[[people]]\nkind = "concerned"\n'
        "start = [2.0, 0.0]\ngoal = [-3.0, 1.0]\n"
    )
    running = Server("--scenario", tmp_path / "room.toml")
    try:
        tab = visit(address=running.address)
        tab.page.keyboard.down("ArrowLeft")
        tab.until("f.time > 3")
        tab.picture("scenario-map")
        tab.page.keyboard.up("ArrowLeft")
        assert tab.panel()["people"][0][0] >= 0.2 + 0.25
        assert len(tab.page.evaluate("window.sidestep.world.walls")) >= 5
        assert tab.panel()["contacts"][0] == 0
    finally:
        assert "Traceback" not in running.stop()


def test_a_record_is_kept_opened_and_scrubbed(visit, tmp_path):
    tab = visit()
    page = tab.page
    page.keyboard.down("ArrowRight")
    tab.until("f.time > 3")
    page.keyboard.up("ArrowRight")

    def keep(entry):
        page.get_by_label("Keep, open, look back").click()
        with page.expect_download(timeout=120_000) as coming:
            page.get_by_text(entry).click()
        path = tmp_path / coming.value.suggested_filename
        coming.value.save_as(path)
        return path

    record = keep("Keep the record (.npz)")
    assert read_record(record).people == ("you",)
    assert keep("Keep a picture (.png)").read_bytes().startswith(b"\x89PNG")
    assert keep("Keep a film (.gif)").read_bytes().startswith(b"GIF8")
    assert b"ftyp" in keep("Keep a film (.mp4)").read_bytes()[:16]

    page.get_by_label("Keep, open, look back").click()
    with page.expect_file_chooser() as choosing:
        page.get_by_text("Open a record").click()
    choosing.value.set_files(record)
    page.wait_for_function("window.sidestep.world.mode === 'record'", timeout=30_000)
    page.locator(".scrub input").focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    tab.until("f.index === 12")
    page.locator(".scrub input").evaluate("s => { s.value = s.max / 2; s.dispatchEvent(new Event('input')); }")
    tab.until("f.index > 20")
    tab.picture("record")
    page.keyboard.press("Home")
    page.get_by_text("Back to live").click()
    page.wait_for_function("window.sidestep.world.mode === 'live'")


def test_a_file_that_is_no_record_is_refused_in_one_line(visit, tmp_path):
    tab = visit()
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(b"not a record")
    tab.page.get_by_label("Keep, open, look back").click()
    with tab.page.expect_file_chooser() as choosing:
        tab.page.get_by_text("Open a record").click()
    choosing.value.set_files(wrong)
    tab.page.get_by_text("wrong.npz:").wait_for()
    assert tab.page.evaluate("window.sidestep.world.mode") == "live"


def test_a_record_from_the_command_line_opens_in_the_same_view(browser, visit, tmp_path):
    from made_records import made_record
    from sidestep.io.records import write_record

    running = Server(write_record(made_record(people=3), tmp_path / "made.npz"))
    try:
        tab = visit(address=running.address, scheme="dark")
        tab.page.keyboard.press("Space")
        tab.until("f.index > 6")
        tab.picture("record-from-the-command-line")
    finally:
        assert "Traceback" not in running.stop()


def test_visitors_are_independent_and_a_closed_tab_frees_its_planner(visit, server):
    before = server.state()["worlds"]
    one, two = visit(), visit()
    assert server.state()["worlds"] == before + 2
    one.page.keyboard.press("Space")
    one.until("!f.running")
    now = two.time()
    two.until(f"f.time > {now + 1} && f.running")
    one.page.close()
    two.page.close()
    for _ in range(100):
        if server.state()["worlds"] <= before:
            break
        time.sleep(0.2)
    assert server.state()["worlds"] <= before


def test_nonsense_over_the_open_connection_does_no_harm(visit):
    tab = visit()
    tab.page.evaluate(
        """() => { const s = window.sidestep.link.socket;
        for (const m of ['', '{', 'null', '[[[[', '{"type":"drag","point":["a",1e999]}', 'x'.repeat(100000)]) s.send(m);
        s.send(new Uint8Array([255, 254, 0])); }"""
    )
    now = tab.time()
    tab.until(f"f.time > {now + 1}")


def test_nonsense_to_the_controls_does_no_harm(visit):
    """A slider's own event, sent again with values that no slider has."""
    tab = visit()
    tab.page.evaluate(
        """() => { const send = window.socket.emit; window.heard = [];
        window.socket.emit = function (name, message) {
          if (name === 'event') window.heard.push(message); return send.apply(this, arguments); }; }"""
    )
    tab.page.locator("[data-setting=horizon] [tabindex]").first.focus()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.wait_for_function("window.sidestep.world.horizon === 7")
    for value in ('"x"', "null", "1e9", "-5", '{"a": 1}', "[[]]", "true"):
        tab.page.evaluate(
            """value => window.heard.filter((m) => m.args.includes('7'))
            .forEach((m) => window.socket.emit('event', {...m, args: m.args.map(() => value)}))""",
            value,
        )
    now = tab.time()
    tab.until(f"f.time > {now + 1}")
    assert tab.page.evaluate("window.sidestep.world.horizon") in range(1, 21)


def test_the_page_comes_back_after_its_connection_is_lost(visit):
    tab = visit()
    tab.page.evaluate("window.sidestep.link.socket.close()")
    tab.page.wait_for_function("document.querySelector('.lost').hidden === false")
    tab.page.wait_for_function("document.querySelector('.lost').hidden === true", timeout=20_000)
    now = tab.time()
    tab.until(f"f.time !== {now}")


def test_pictures_can_be_told_apart_by_people_who_confuse_red_and_green(visit):
    """The page as a deuteranope sees it is kept too, to be looked at."""
    tab = visit()
    tab.page.keyboard.down("ArrowRight")
    tab.until("p.distance < 3")
    tab.page.keyboard.up("ArrowRight")
    session = tab.page.context.new_cdp_session(tab.page)
    for kind in ("deuteranopia", "protanopia", "tritanopia", "achromatopsia"):
        session.send("Emulation.setEmulatedVisionDeficiency", {"type": kind})
        tab.picture(f"seen-with-{kind}")
        assert (RESULTS / f"seen-with-{kind}.png").stat().st_size > 10_000


def test_it_says_so_when_other_machines_can_reach_it():
    running = Server("--host", "0.0.0.0")
    said = running.stop()
    assert "reachable from other machines" in said
