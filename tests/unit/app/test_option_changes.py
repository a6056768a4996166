"""Options by name: what is accepted, what is refused, and how each is described."""

import dataclasses
import inspect
import re

import msgspec
import pytest

from calib_core.errors import OptionError
from calib_core.options import (
    RANGES,
    CalibrationOptions,
    CameraPositionPrior,
    GatingOptions,
    PaperOptions,
    SolvingOptions,
    checked_options,
)
from calib_core.recordings import RecordingOptions
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.rig import RigOptions
from cocalib import option_changes
from cocalib.option_changes import (
    OptionChange,
    changed_options,
    changes_from_tree,
    option_groups,
    options_from_tree,
)

DESCRIPTIONS = {option.path: option for group in option_groups() for option in group.options}


def test_a_partial_tree_changes_what_it_names_and_nothing_else():
    options = changed_options(
        CalibrationOptions(),
        changes_from_tree({"method": "paper", "gating": {"max_range_m": 20, "max_speed_mps": 0.0}}),
    )
    assert options == CalibrationOptions(method="paper", gating=GatingOptions(max_range_m=20.0, max_speed_mps=0.0))


def test_all_options_come_back_from_their_own_tree():
    options = CalibrationOptions(
        method="paper",
        solving=SolvingOptions(camera_position=CameraPositionPrior((0.1, -0.2, 0.3), 0.02), seed=7),
        paper=PaperOptions(window="whole-second"),
    )
    text = msgspec.json.encode(msgspec.to_builtins(options))
    assert options_from_tree(msgspec.json.decode(text)) == options


def test_a_camera_position_is_set_and_removed_as_a_whole():
    tree = {"solving": {"camera_position": {"position_m": [0.1, 0.2, 0.3], "sigma_m": 0.02}}}
    options = options_from_tree(tree)
    assert options.solving.camera_position == CameraPositionPrior((0.1, 0.2, 0.3), 0.02)
    assert changed_options(options, changes_from_tree({"solving": {"camera_position": None}})) == CalibrationOptions()


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ({"noise": {"sigma_pixel": 1.0}}, "unknown option 'noise.sigma_pixel'; did you mean noise.sigma_px?"),
        ({"sigma_px": 1.0}, "did you mean noise.sigma_px?"),
        ({"xyzzy": 1.0}, "known groups: gating, "),
        ({"noise": {"sigma_px": "wide"}}, "option noise.sigma_px: expected `float`, got `str`"),
        ({"noise": {"sigma_px": None}}, "option noise.sigma_px"),
        ({"noise": {"estimate_scale": 1}}, "option noise.estimate_scale"),
        ({"method": "best"}, "option method: invalid enum value 'best'"),
        ({"noise": 3}, "options noise: expected an object of names and values"),
        ([1, 2], "options: expected an object of names and values"),
        ({"solving": {"camera_position": {"sigma_m": "x"}}}, "option solving.camera_position"),
        ({"solving": {"seed": 1.5}}, "option solving.seed"),
        ({"noise": {"sigma_px": 0.0}}, "option noise.sigma_px: 0 is out of range; allowed: 0.01 to 1000 px"),
        ({"locating": {"max_candidates": 0}}, "option locating.max_candidates: 0 is out of range; allowed: 1 to 50"),
        ({"solving": {"camera_position": {"sigma_m": 0.0}}}, "option solving.camera_position.sigma_m"),
        ({"solving": {"camera_position": {"position_m": [0, 0, 1e9]}}}, "option solving.camera_position.position_m"),
        ({"gating": {"min_range_m": 70.0}}, "70 m is not below gating.max_range_m, 60 m"),
    ],
)
def test_what_is_not_understood_or_out_of_range_is_refused_with_a_clear_error(tree, words):
    with pytest.raises(OptionError) as refused:
        options_from_tree(tree)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_no_number_may_be_infinite_or_missing(value):
    for path in (path for path in RANGES if "camera_position" not in path):
        with pytest.raises(OptionError, match=rf"{re.escape(path)}: \S+ is out of range"):
            changed_options(CalibrationOptions(), [OptionChange(path, value)])


def test_a_choice_that_was_set_directly_is_checked_too():
    assert checked_options(CalibrationOptions()) == CalibrationOptions()
    with pytest.raises(OptionError, match="unknown value 'best'; choose default or paper"):
        checked_options(CalibrationOptions(method="best"))


def test_every_number_among_the_options_has_a_range_and_every_range_an_option():
    numbers = {path for path, option in DESCRIPTIONS.items() if option.kind in ("number", "integer")}
    prior = {f"solving.camera_position.{field.name}" for field in dataclasses.fields(CameraPositionPrior)}
    assert set(RANGES) == numbers | prior


def test_every_option_field_has_its_text_in_its_metadata():
    assert "inspect.getsource" not in inspect.getsource(option_changes)
    for kind in (CalibrationOptions, RecordingOptions, SimulationOptions, RigOptions):
        for field in dataclasses.fields(kind):
            if "help" not in field.metadata:
                assert dataclasses.is_dataclass(field.default_factory), field.name  # a group of options


def test_a_description_has_all_that_an_input_field_needs():
    option = DESCRIPTIONS["noise.sigma_azimuth_deg"]
    assert (option.label, option.unit, option.kind) == ("sigma azimuth", "deg", "number")
    assert (option.low, option.high, option.default) == (1e-3, 45.0, 0.5)
    assert DESCRIPTIONS["paper.window"].choices == ("centred", "whole-second")
    assert DESCRIPTIONS["solving.camera_position"].kind == "camera-position"
    assert option_groups()[0].name == ""
    assert all(len(option.hint) > 5 and "\n" not in option.hint for option in DESCRIPTIONS.values())
    assert all(group.hint for group in option_groups())
