"""The JSON form of each step, in the journal and in messages from the page."""

from functools import singledispatch
from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta

from app.option_changes import options_from_tree
from app.session import (
    AssumptionsConfirmed,
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    ColumnsMapped,
    OptionsChanged,
    Redo,
    Step,
    Undo,
)
from calib_core.measurements import ReflectorClick, Stamp

__all__ = [
    "AssumptionsConfirmedForm",
    "ClearedForm",
    "ClickExcludedForm",
    "ClickForm",
    "ClickId",
    "ClickMovedForm",
    "ClickPlacedForm",
    "ClickRemovedForm",
    "ClicksImportedForm",
    "ColumnsMappedForm",
    "OptionsChangedForm",
    "PixelForm",
    "RedoForm",
    "StampForm",
    "StepForm",
    "UndoForm",
    "click_from_form",
    "form_of_click",
    "form_of_step",
    "step_from_form",
]

ClickId: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]
PixelForm: TypeAlias = tuple[float, float]
MapForm: TypeAlias = Annotated[str, Meta(max_length=500)]
AssumptionForm: TypeAlias = Annotated[str, Meta(max_length=2000)]


class StampForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A time."""

    sec: Annotated[int, Meta(ge=0, le=9_223_372_035)]
    nanosec: Annotated[int, Meta(ge=0, le=999_999_999)]

    @classmethod
    def of(cls, stamp: Stamp) -> "StampForm":
        """Convert a stamp to its JSON form."""
        return cls(stamp.sec, stamp.nanosec)

    @property
    def stamp(self) -> Stamp:
        """The stamp as the session uses it."""
        return Stamp(self.sec, self.nanosec)


class ClickForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A click, as in a clicks-1 file."""

    id: ClickId
    image_time: StampForm
    pixel_px: PixelForm
    sigma_px: float | None = None
    excluded: bool = False


class _Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A JSON object with a "type"."""


class ClickPlacedForm(_Form, frozen=True, tag="click_placed"):
    """A click in a frame."""

    image_time: StampForm
    pixel_px: PixelForm


class ClickMovedForm(_Form, frozen=True, tag="click_moved"):
    """A click dragged or nudged."""

    id: ClickId
    pixel_px: PixelForm


class ClickRemovedForm(_Form, frozen=True, tag="click_removed"):
    """A click deleted."""

    id: ClickId


class ClickExcludedForm(_Form, frozen=True, tag="click_excluded"):
    """A click excluded, or included again."""

    id: ClickId
    excluded: bool


class OptionsChangedForm(_Form, frozen=True, tag="options_changed"):
    """Options by group and name; the journal contains all of them, a page may send only some."""

    options: dict[str, Any]


class ClearedForm(_Form, frozen=True, tag="cleared"):
    """All clicks deleted."""


class ClicksImportedForm(_Form, frozen=True, tag="clicks_imported"):
    """Clicks from a file."""

    clicks: tuple[ClickForm, ...]


class ColumnsMappedForm(_Form, frozen=True, tag="columns_mapped"):
    """The recording is read with these columns."""

    column_map: tuple[MapForm, ...]


class AssumptionsConfirmedForm(_Form, frozen=True, tag="assumptions_confirmed"):
    """Assumptions about the recording confirmed, by their texts."""

    texts: Annotated[tuple[AssumptionForm, ...], Meta(max_length=100)]


class UndoForm(_Form, frozen=True, tag="undo"):
    """The last change undone."""


class RedoForm(_Form, frozen=True, tag="redo"):
    """The last undone change redone."""


StepForm: TypeAlias = (
    ClickPlacedForm
    | ClickMovedForm
    | ClickRemovedForm
    | ClickExcludedForm
    | OptionsChangedForm
    | ClearedForm
    | ClicksImportedForm
    | ColumnsMappedForm
    | AssumptionsConfirmedForm
    | UndoForm
    | RedoForm
)


def form_of_click(click: ReflectorClick) -> ClickForm:
    """Convert a click to its JSON form."""
    stamp = StampForm.of(Stamp.of(click.image_time))
    return ClickForm(click.id, stamp, (click.u_px, click.v_px), click.sigma_px, click.excluded)


def click_from_form(form: ClickForm) -> ReflectorClick:
    """Convert a click from its JSON form."""
    return ReflectorClick(form.image_time.stamp.time, form.id, *form.pixel_px, form.sigma_px, form.excluded)


@singledispatch
def form_of_step(step: Step) -> StepForm:
    """Convert a step to its JSON form; answers of the solver and partial option edits have none.

    Raises:
        TypeError: the step has no form.
    """
    raise TypeError(f"{type(step).__name__} is not journalled")


@singledispatch
def step_from_form(form: StepForm) -> Step:
    """Convert a step from its JSON form.

    Raises:
        OptionError: an option is unknown, of the wrong type or out of range.
    """
    raise TypeError(f"not the form of a step: {form!r}")


@form_of_step.register
def _form_of_placed(step: ClickPlaced) -> StepForm:
    return ClickPlacedForm(StampForm.of(Stamp.of(step.image_time)), (step.u_px, step.v_px))


@form_of_step.register
def _form_of_moved(step: ClickMoved) -> StepForm:
    return ClickMovedForm(step.id, (step.u_px, step.v_px))


@form_of_step.register
def _form_of_removed(step: ClickRemoved) -> StepForm:
    return ClickRemovedForm(step.id)


@form_of_step.register
def _form_of_excluded(step: ClickExcluded) -> StepForm:
    return ClickExcludedForm(step.id, step.excluded)


@form_of_step.register
def _form_of_options(step: OptionsChanged) -> StepForm:
    return OptionsChangedForm(msgspec.to_builtins(step.options))


@form_of_step.register
def _form_of_cleared(step: Cleared) -> StepForm:
    return ClearedForm()


@form_of_step.register
def _form_of_imported(step: ClicksImported) -> StepForm:
    return ClicksImportedForm(tuple(form_of_click(click) for click in step.clicks))


@form_of_step.register
def _form_of_mapped(step: ColumnsMapped) -> StepForm:
    return ColumnsMappedForm(step.column_map)


@form_of_step.register
def _form_of_confirmed(step: AssumptionsConfirmed) -> StepForm:
    return AssumptionsConfirmedForm(step.texts)


@form_of_step.register
def _form_of_undo(step: Undo) -> StepForm:
    return UndoForm()


@form_of_step.register
def _form_of_redo(step: Redo) -> StepForm:
    return RedoForm()


@step_from_form.register
def _placed(form: ClickPlacedForm) -> Step:
    return ClickPlaced(form.image_time.stamp.time, *form.pixel_px)


@step_from_form.register
def _moved(form: ClickMovedForm) -> Step:
    return ClickMoved(form.id, *form.pixel_px)


@step_from_form.register
def _removed(form: ClickRemovedForm) -> Step:
    return ClickRemoved(form.id)


@step_from_form.register
def _excluded(form: ClickExcludedForm) -> Step:
    return ClickExcluded(form.id, form.excluded)


@step_from_form.register
def _options(form: OptionsChangedForm) -> Step:
    return OptionsChanged(options_from_tree(form.options))


@step_from_form.register
def _cleared(form: ClearedForm) -> Step:
    return Cleared()


@step_from_form.register
def _imported(form: ClicksImportedForm) -> Step:
    return ClicksImported(tuple(click_from_form(click) for click in form.clicks))


@step_from_form.register
def _mapped(form: ColumnsMappedForm) -> Step:
    return ColumnsMapped(form.column_map)


@step_from_form.register
def _confirmed(form: AssumptionsConfirmedForm) -> Step:
    return AssumptionsConfirmed(form.texts)


@step_from_form.register
def _undo(form: UndoForm) -> Step:
    return Undo()


@step_from_form.register
def _redo(form: RedoForm) -> Step:
    return Redo()
