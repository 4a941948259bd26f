"""What a live page is made of, without a browser: messages, settings, the steered person, sentences, images."""

from __future__ import annotations

import json
import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep.errors import InvalidInput, UnknownName
from sidestep.lattice import Lattice, heading_rotation
from sidestep.obstacles import Obstacles
from sidestep.planning.plan import PersonPlan
from sidestep.prediction.occupancy import Occupancy
from sidestep.viewer.live import messages, words
from sidestep.viewer.live.evidence import CHANCE, Evidence
from sidestep.viewer.live.heat import FAINTEST, MOST_INSTANTS, STRONGEST, heat, paint
from sidestep.viewer.live.settings import LiveSettings
from sidestep.viewer.live.tally import Tally
from sidestep.viewer.live.visitor import ACCELERATION, HURRYING_SPEED, WALKING_SPEED, Visitor
from sidestep.viewer.live.wire import numbers, text, with_images

STEP = 0.05  # s
FLOOR = (-4.0, -4.0, 4.0, 4.0)

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@given(st.binary(max_size=400) | json_values.map(lambda value: json.dumps(value).encode()))
def test_whatever_is_not_a_message_is_none(data):
    assert messages.read(data) is None


@given(
    st.sampled_from(["drag", "walk", "seek", "ping", "play", "nonsense"]),
    st.dictionaries(
        st.sampled_from(["point", "direction", "index", "sent", "hurry", "other"]), json_values, max_size=4
    ),
)
def test_what_is_read_is_within_its_range(kind, fields):
    message = messages.read(json.dumps({"type": kind, **fields}))
    if isinstance(message, messages.Drag) and message.point is not None:
        assert np.isfinite(message.point).all()
        assert np.abs(message.point).max() <= 1e4
    if isinstance(message, messages.Walk):
        assert np.isfinite(message.direction).all()
    if isinstance(message, messages.Seek):
        assert message.index >= 0


@pytest.mark.parametrize(
    "line",
    [
        '{"type":"drag","point":[NaN,0]}',
        '{"type":"drag","point":[1e300,0]}',
        '{"type":"drag","point":[1,2,3]}',
        '{"type":"drag"}',
        '{"type":"walk","direction":["up",0]}',
        '{"type":"seek","index":-1}',
        '{"type":"play","and":"more"}',
        "[" * 5000,
        '{"type":"ping","sent":' + "9" * 4000 + "}",
    ],
)
def test_malformed_messages_are_none(line):
    assert messages.read(line) is None


def test_honest_messages_are_read():
    assert messages.read('{"type":"drag","point":[1,-2.5]}') == messages.Drag(type="drag", point=(1.0, -2.5))
    assert messages.read('{"type":"drag","point":null}') == messages.Drag(type="drag", point=None)
    assert messages.read('{"type":"step"}') == messages.Transport(type="step")


@pytest.mark.parametrize(
    ("name", "value"),
    [("horizon", 0), ("horizon", 1000), ("risk_limit", math.nan), ("people", -1), ("beside", "rm"), ("scenario", 7)],
)
def test_a_setting_outside_its_range_is_one_line(name, value):
    with pytest.raises(InvalidInput, match=f"live.{name}") as caught:
        LiveSettings().changed(name, value)
    assert "\n" not in str(caught.value)


def test_an_unknown_setting_is_named():
    with pytest.raises(UnknownName, match="risk_limit"):
        LiveSettings().changed("risk_limits", 0.1)


def _visitor(**changes):
    return Visitor(**({"start": (0.0, 0.0), "radius": 0.3, "bounds": FLOOR} | changes))


def _walk(visitor, seconds, start=0.0):
    for k in range(round(seconds / STEP)):
        visitor.move(start + k * STEP, start + (k + 1) * STEP)
    return start + round(seconds / STEP) * STEP


orders = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.booleans(), st.booleans()), min_size=1, max_size=20)


@given(orders)
def test_a_visitor_moves_as_a_body_can_and_stays_on_the_floor(orders):
    visitor, before, time = _visitor(), np.zeros(2), 0.0
    for x, y, hold, hurry in orders:
        if hold:
            visitor.drag((x, y))
        else:
            visitor.drag(None)
            visitor.walk((x, y), hurry=hurry)
        for _ in range(4):
            visitor.move(time, time + STEP)
            time += STEP
            assert np.linalg.norm(visitor.velocity) <= HURRYING_SPEED + 1e-9
            inside = np.abs(visitor.place).max() < 4.0 - 1e-9
            if inside:  # the edge of the floor may stop a person at once
                assert np.linalg.norm(visitor.velocity - before) <= ACCELERATION * STEP + 1e-9
            before = visitor.velocity
            assert np.abs(visitor.place).max() <= 4.0 + 1e-12


def test_arrow_keys_walk_and_shift_hurries():
    visitor = _visitor()
    visitor.walk((0.0, 5.0))
    time = _walk(visitor, 1.0)
    np.testing.assert_allclose(visitor.velocity, (0.0, WALKING_SPEED))
    visitor.walk((0.0, 5.0), hurry=True)
    _walk(visitor, 1.0, time)
    np.testing.assert_allclose(visitor.velocity, (0.0, HURRYING_SPEED))


def test_a_dragged_visitor_arrives_at_the_hand_and_stays():
    visitor = _visitor()
    visitor.drag((2.0, -1.0))
    time = _walk(visitor, 4.0)
    np.testing.assert_allclose(visitor.place, (2.0, -1.0), atol=0.02)
    visitor.drag(None)
    _walk(visitor, 1.0, time)
    np.testing.assert_allclose(visitor.velocity, 0.0, atol=1e-9)


def test_two_worlds_see_the_same_visitor_at_the_same_time():
    visitor = _visitor()
    visitor.walk((1.0, 0.0))
    _walk(visitor, 1.0)
    here = visitor.position(1.0)
    visitor.move(1.0, 1.05)  # the first world has moved on …
    np.testing.assert_array_equal(visitor.position(1.0), here)  # … the second one still looks at this instant
    there = visitor.position(1.05)
    visitor.move(1.0, 1.05)
    np.testing.assert_array_equal(visitor.position(1.05), there)
    assert there[0] > here[0]


def test_before_a_trip_the_visitor_came_from_where_the_velocity_says():
    visitor = _visitor()
    visitor.walk((1.0, 0.0))
    _walk(visitor, 1.0)
    visitor.new_trip()
    np.testing.assert_allclose(visitor.position(0.0) - visitor.position(-STEP), STEP * visitor.velocity)


def test_walls_stop_a_visitor_and_let_them_slide():
    wall = np.array([[1.0, -4.0], [1.4, -4.0], [1.4, 4.0], [1.0, 4.0]])
    visitor = _visitor(obstacles=Obstacles(polygons=(wall,)))
    visitor.walk((1.0, 1.0))
    _walk(visitor, 3.0)
    assert visitor.place[0] <= 0.7 + 1e-6
    assert visitor.place[1] > 2.0


def test_a_tally_tells_contacts_while_moving_from_contacts_while_standing():
    tally = Tally()
    for distance, speed in ((2.0, 1.0), (0.5, 1.0), (0.4, 1.0), (1.0, 1.0), (0.5, 0.0), (0.5, 0.0), (2.0, 1.0)):
        tally.instant(distance=distance, contact=0.6, speed=speed, approaching=speed > 0)
    assert (tally.contacts_moving, tally.contacts_standing) == (1, 1)
    assert tally.closest == 0.4
    tally.elapsed = 7.5
    tally.finish()
    tally.next_trip()
    assert tally.times == [7.5]
    assert math.isinf(tally.closest)
    assert "2 contacts, 1 while moving" in tally.summary()


def test_distance_counts_as_approached_only_while_the_robot_itself_comes_nearer():
    tally = Tally()
    tally.instant(distance=1.0, contact=0.6, speed=0.0, approaching=False)
    tally.instant(distance=0.9, contact=0.6, speed=1.0, approaching=False)
    assert math.isinf(tally.closest_approaching)
    tally.instant(distance=1.2, contact=0.6, speed=1.0, approaching=True)
    assert tally.closest_approaching == 1.2


def test_chances_are_counted_in_a_row_and_at_most_two_a_second():
    evidence = Evidence()
    for k in range(17):  # the belief halves its odds every quarter of a second for four seconds
        evidence.note(k * CHANCE / 2, 0.5 ** (k / 2) / (1 + 0.5 ** (k / 2)))
    assert (evidence.ignored, evidence.taken) == (8, 0)
    evidence.note(9 * CHANCE, 0.9)
    assert (evidence.ignored, evidence.taken) == (0, 1)


def test_a_belief_that_does_not_move_is_no_chance():
    evidence = Evidence()
    for k in range(40):
        evidence.note(0.2 * k, 0.5)
    assert (evidence.ignored, evidence.taken) == (0, 0)


situations = st.builds(
    words.Situation,
    you=st.booleans(),
    status=st.sampled_from(["certified", "least_risk", "stopped"]),
    reason=st.sampled_from(["", "no data."]),
    speed=st.floats(0, 2),
    distance=st.none() | st.floats(0, 9),
    belief=st.none() | st.floats(0, 1),
    ignored=st.integers(0, 40),
    taken=st.integers(0, 40),
    keeping=st.none() | st.floats(0, 9),
    risk=st.none() | st.floats(0, 1),
)


@given(situations)
def test_every_situation_has_one_whole_sentence(situation):
    line = words.describe(situation)
    assert line.endswith(".")
    assert ".." not in line
    assert "\n" not in line
    assert line[0].isupper()
    assert len(line) < 150


def test_the_sentence_for_somebody_who_does_not_give_way():
    situation = words.Situation(
        you=False, status="certified", speed=0.8, distance=2.0, belief=0.04, ignored=3, keeping=1.43
    )
    assert words.describe(situation) == (
        "The person has not reacted to three chances to give way: treating them as unconcerned, keeping 1.4 m."
    )


def test_the_sentence_for_a_visitor_who_gives_way():
    situation = words.Situation(
        you=True, status="certified", speed=0.8, distance=2.0, belief=0.97, taken=2, keeping=0.92
    )
    assert words.describe(situation) == "You have given way twice: counting on you, keeping 0.9 m."


@given(
    st.integers(1, 4),
    st.floats(-math.pi, math.pi),
    st.integers(0, 10**6),
    st.tuples(st.floats(-9, 9), st.floats(-9, 9)),
)
def test_every_pixel_lies_where_its_cell_lies(radius, angle, choice, origin):
    lattice = Lattice(
        origin=np.array(origin),
        spacing=0.37,
        radius=radius,
        rotation=heading_rotation((math.cos(angle), math.sin(angle))),
    )
    mass = np.zeros((2, *lattice.shape))
    cell = np.unravel_index(choice % mass[0].size, lattice.shape)
    mass[:, *cell] = 1.0
    image = paint(mass, lattice, (0, 1))
    row, column = np.argwhere(image.pixels[1] == 255)[0]
    local = image.first + image.spacing * np.array([row, column])
    np.testing.assert_allclose(image.origin + image.rotation @ local, lattice.positions()[cell], atol=1e-9)


def test_brightness_follows_the_logarithm_of_density():
    lattice = Lattice(origin=np.zeros(2), spacing=0.5, radius=1)
    densities = np.array([0.0, FAINTEST / 2, FAINTEST, math.sqrt(FAINTEST * STRONGEST), STRONGEST, 2 * STRONGEST])
    mass = np.zeros((1, 3, 3))
    mass[0].flat[: densities.size] = densities * 0.25
    np.testing.assert_array_equal(paint(mass, lattice, (0,)).pixels[0].flat[:6], [0, 0, 0, 128, 255, 255])


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_people_of_any_dimension_are_seen_from_above(dimension):
    lattice = Lattice(origin=np.ones(dimension), spacing=0.5, radius=2)
    mass = np.full((3, *lattice.shape), 1.0 / 5**dimension)
    image = paint(mass, lattice, (0, 1, 2))
    assert image.pixels.shape == (3, 5, 1 if dimension == 1 else 5)
    assert image.origin.shape == (2,)


def _plan_of_somebody(mass, spacing, spread=None):
    lattice = Lattice(origin=np.zeros(2), spacing=spacing, radius=(mass.shape[1] - 1) // 2)
    return PersonPlan(
        belief=0.5, foretell=lambda: Occupancy(lattice=lattice, probability=mass, time_step=0.5),
        collision_probability=np.zeros(len(mass) - 1), goals={}, randomness=0.1, position=np.zeros(2),
        velocity=np.zeros(2), spread=spread,
    )  # fmt: skip


def test_long_horizons_are_thinned_and_keep_their_ends():
    image = heat(_plan_of_somebody(np.full((31, 3, 3), 1 / 9), 0.5))
    assert len(image.instants) == MOST_INSTANTS
    assert image.instants[0] == 0
    assert image.instants[-1] == 30


def test_steadiness_is_drawn_as_the_density_that_it_means():
    sigmas = np.array([[0.05, 0.1], [0.4, 0.8]])
    weights = np.array([0.7, 0.3])
    mass = np.zeros((2, 5, 5))
    mass[:, 2, 3] = 1.0
    image = heat(_plan_of_somebody(mass, 0.25, (weights, sigmas)))
    rows, columns = (image.first[i] + 0.25 * np.arange(image.pixels.shape[1 + i]) for i in range(2))
    square = rows[:, None] ** 2 + (columns[None] - 0.25) ** 2
    density = sum(
        w * np.exp(-square / (2 * s**2)) / (2 * np.pi * s**2) for w, s in zip(weights, sigmas[1], strict=True)
    )
    expected = 255 * np.log(density / FAINTEST) / np.log(STRONGEST / FAINTEST)
    assert np.abs(image.pixels[1] - np.clip(expected, 0, 255)).max() < 8
    assert image.pixels[0].max() == 255


def test_images_follow_their_description():
    lattice = Lattice(origin=np.zeros(2), spacing=0.5, radius=1)
    mass = np.random.default_rng(1).uniform(size=(2, 3, 3))
    images = [paint(mass, lattice, (0, 4)), paint(mass[:1], lattice, (0,))]
    packet = with_images(images, type="plan", value=math.nan)
    (length,) = struct.unpack("<I", packet[:4])
    head = json.loads(packet[4 : 4 + length])
    assert head["value"] is None
    offset = 4 + length
    for image, description in zip(images, head["heats"], strict=True):
        size = math.prod(description["shape"])
        assert packet[offset : offset + size] == image.pixels.tobytes()
        offset += size
    assert offset == len(packet)


def test_what_is_not_a_number_travels_as_null():
    assert json.loads(text(a=[1.0, math.inf], b={"c": math.nan})) == {"a": [1.0, None], "b": {"c": None}}
    assert numbers(np.array([[1.23456, math.nan]])) == [[1.235, None]]
