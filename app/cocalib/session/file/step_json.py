"""The JSON form of each step, in the journal and in messages from the page."""

from functools import singledispatch
from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta

from calib_core.measurements import ChosenReturn, Mark, ReflectorClick, Stamp
from cocalib.option_changes import kept_options
from cocalib.session import (
    AssumptionsConfirmed,
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    ColumnsMapped,
    IntrinsicsChosen,
    OptionsChanged,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    Step,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.file import box_json as boxes
from cocalib.session.file.form_parts import StampForm, StepPart
from cocalib.session.file.intrinsics_json import IntrinsicsChosenForm, chosen_from_form, form_of_chosen

ClickId: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]
PixelForm: TypeAlias = tuple[float, float]
PositionForm: TypeAlias = tuple[float, float, float]
CodeForm: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]
MapForm: TypeAlias = Annotated[str, Meta(max_length=500)]
AssumptionForm: TypeAlias = Annotated[str, Meta(max_length=2000)]


class ReturnForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A chosen radar return, as in a clicks-1 file."""

    position_m: PositionForm
    radar_time: StampForm | None = None
    topic: Annotated[str, Meta(max_length=500)] = ""


class ClickForm(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, rename={"chosen": "return"}
):
    """A click, as in a clicks-1 file."""

    id: ClickId
    image_time: StampForm
    pixel_px: PixelForm
    sigma_px: float | None = None
    excluded: bool = False
    mark: Mark = "clicked"
    chosen: ReturnForm | None = None


class ClickPlacedForm(StepPart, frozen=True, tag="click_placed"):
    """A mark in a frame; without "mark" in a journal, the click that the frame already has is moved."""

    image_time: StampForm
    pixel_px: PixelForm
    mark: Mark | None = None
    sigma_px: float | None = None


class ClickMovedForm(StepPart, frozen=True, tag="click_moved"):
    """A click dragged, nudged or snapped."""

    id: ClickId
    pixel_px: PixelForm
    mark: Mark = "moved"
    sigma_px: float | None = None


class ClickRemovedForm(StepPart, frozen=True, tag="click_removed"):
    """A click deleted."""

    id: ClickId


class ClickExcludedForm(StepPart, frozen=True, tag="click_excluded"):
    """A click excluded, or included again."""

    id: ClickId
    excluded: bool


class ReturnChosenForm(StepPart, frozen=True, tag="return_chosen", rename={"chosen": "return"}):
    """A return chosen for a click; null takes the choice back."""

    id: ClickId
    chosen: ReturnForm | None


class PlacementDismissedForm(StepPart, frozen=True, tag="placement_dismissed"):
    """A placement dismissed, or offered again."""

    time: StampForm
    position_m: PositionForm
    dismissed: bool = True


class WarningsAcknowledgedForm(StepPart, frozen=True, tag="warnings_acknowledged"):
    """Warnings read, or shown again, by their codes."""

    codes: Annotated[tuple[CodeForm, ...], Meta(max_length=100)]
    acknowledged: bool = True


class OptionsChangedForm(StepPart, frozen=True, tag="options_changed"):
    """Options by group and name; the journal contains all of them, a page may send only some."""

    options: dict[str, Any]


class ClearedForm(StepPart, frozen=True, tag="cleared"):
    """All clicks deleted."""


class ClicksImportedForm(StepPart, frozen=True, tag="clicks_imported"):
    """Clicks from a file."""

    clicks: tuple[ClickForm, ...]


class ColumnsMappedForm(StepPart, frozen=True, tag="columns_mapped"):
    """The recording is read with these columns."""

    column_map: tuple[MapForm, ...]


class AssumptionsConfirmedForm(StepPart, frozen=True, tag="assumptions_confirmed"):
    """Assumptions about the recording confirmed, by their texts."""

    texts: Annotated[tuple[AssumptionForm, ...], Meta(max_length=100)]


class UndoForm(StepPart, frozen=True, tag="undo"):
    """The last change undone."""


class RedoForm(StepPart, frozen=True, tag="redo"):
    """The last undone change redone."""


StepForm: TypeAlias = (
    ClickPlacedForm
    | ClickMovedForm
    | ClickRemovedForm
    | ClickExcludedForm
    | ReturnChosenForm
    | PlacementDismissedForm
    | WarningsAcknowledgedForm
    | OptionsChangedForm
    | ClearedForm
    | IntrinsicsChosenForm
    | ClicksImportedForm
    | ColumnsMappedForm
    | AssumptionsConfirmedForm
    | boxes.BoxDrawnForm
    | boxes.BoxMovedForm
    | boxes.BoxHiddenForm
    | boxes.BoxKeyframeRemovedForm
    | boxes.BoxRemovedForm
    | boxes.BoxLabelledForm
    | boxes.BoxesLoadedForm
    | UndoForm
    | RedoForm
)


def form_of_click(click: ReflectorClick) -> ClickForm:
    """Convert a click to its JSON form."""
    stamp = StampForm.of(Stamp.of(click.image_time))
    pixel = (click.u_px, click.v_px)
    chosen = form_of_return(click.chosen)
    return ClickForm(click.id, stamp, pixel, click.sigma_px, click.excluded, click.mark, chosen)


def click_from_form(form: ClickForm) -> ReflectorClick:
    """Convert a click from its JSON form."""
    chosen = return_from_form(form.chosen)
    time = form.image_time.stamp.time
    return ReflectorClick(time, form.id, *form.pixel_px, form.sigma_px, form.excluded, form.mark, chosen)


def form_of_return(chosen: ChosenReturn | None) -> ReturnForm | None:
    """Convert a chosen return to its JSON form; None stays None."""
    if chosen is None:
        return None
    time = None if chosen.radar_time is None else StampForm.of(Stamp.of(chosen.radar_time))
    return ReturnForm(chosen.position_m, time, chosen.topic)


def return_from_form(form: ReturnForm | None) -> ChosenReturn | None:
    """Convert a chosen return from its JSON form; None stays None."""
    if form is None:
        return None
    return ChosenReturn(form.position_m, None if form.radar_time is None else form.radar_time.stamp.time, form.topic)


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


for _event, _form_of in boxes.FORM_OF:
    form_of_step.register(_event)(_form_of)


for _form, _event_of in boxes.EVENT_OF:
    step_from_form.register(_form)(_event_of)


form_of_step.register(IntrinsicsChosen)(form_of_chosen)
step_from_form.register(IntrinsicsChosenForm)(chosen_from_form)


@form_of_step.register
def _form_of_placed(step: ClickPlaced) -> StepForm:
    stamp = StampForm.of(Stamp.of(step.image_time))
    return ClickPlacedForm(stamp, (step.u_px, step.v_px), step.mark, step.sigma_px)


@form_of_step.register
def _form_of_moved(step: ClickMoved) -> StepForm:
    return ClickMovedForm(step.id, (step.u_px, step.v_px), step.mark, step.sigma_px)


@form_of_step.register
def _form_of_removed(step: ClickRemoved) -> StepForm:
    return ClickRemovedForm(step.id)


@form_of_step.register
def _form_of_excluded(step: ClickExcluded) -> StepForm:
    return ClickExcludedForm(step.id, step.excluded)


@form_of_step.register
def _form_of_chosen(step: ReturnChosen) -> StepForm:
    return ReturnChosenForm(step.id, form_of_return(step.chosen))


@form_of_step.register
def _form_of_dismissed(step: PlacementDismissed) -> StepForm:
    return PlacementDismissedForm(StampForm.of(Stamp.of(step.time)), step.position_m, step.dismissed)


@form_of_step.register
def _form_of_acknowledged(step: WarningsAcknowledged) -> StepForm:
    return WarningsAcknowledgedForm(step.codes, step.acknowledged)


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
    return ClickPlaced(form.image_time.stamp.time, *form.pixel_px, form.mark, form.sigma_px)


@step_from_form.register
def _moved(form: ClickMovedForm) -> Step:
    return ClickMoved(form.id, *form.pixel_px, form.mark, form.sigma_px)


@step_from_form.register
def _removed(form: ClickRemovedForm) -> Step:
    return ClickRemoved(form.id)


@step_from_form.register
def _excluded(form: ClickExcludedForm) -> Step:
    return ClickExcluded(form.id, form.excluded)


@step_from_form.register
def _chosen(form: ReturnChosenForm) -> Step:
    return ReturnChosen(form.id, return_from_form(form.chosen))


@step_from_form.register
def _dismissed(form: PlacementDismissedForm) -> Step:
    return PlacementDismissed(form.time.stamp.time, form.position_m, form.dismissed)


@step_from_form.register
def _acknowledged(form: WarningsAcknowledgedForm) -> Step:
    return WarningsAcknowledged(form.codes, form.acknowledged)


@step_from_form.register
def _options(form: OptionsChangedForm) -> Step:
    return OptionsChanged(kept_options(form.options))


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
