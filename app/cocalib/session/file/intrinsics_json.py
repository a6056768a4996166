"""The JSON form of intrinsics that were chosen for a session, and of the step that chooses them."""

from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta

from cocalib.session import ChosenIntrinsics, IntrinsicsChosen
from cocalib.session.file.form_parts import StepPart

WordsForm: TypeAlias = Annotated[str, Meta(max_length=500)]
NameForm: TypeAlias = Annotated[str, Meta(max_length=100)]
PixelCount: TypeAlias = Annotated[int, Meta(ge=1, le=1_000_000)]
RowForm: TypeAlias = Annotated[tuple[float, ...], Meta(max_length=40)]


class IntrinsicsForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A camera, and where it comes from."""

    about: WordsForm
    model: NameForm
    size_px: tuple[PixelCount, PixelCount]
    matrix_px: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    distortion: RowForm = ()
    order: Annotated[tuple[NameForm, ...], Meta(max_length=40)] = ()
    covariance: Annotated[tuple[RowForm, ...], Meta(max_length=40)] = ()


class IntrinsicsChosenForm(StepPart, frozen=True, tag="intrinsics_chosen"):
    """Intrinsics chosen for the session; null goes back to those that it was opened with."""

    intrinsics: IntrinsicsForm | None


def form_of_intrinsics(chosen: ChosenIntrinsics | None) -> IntrinsicsForm | None:
    """Convert intrinsics to their JSON form; None stays None."""
    if chosen is None:
        return None
    (first, second, third), size_px = chosen.matrix_px, chosen.size_px
    matrix_px = (first[0], first[1], first[2]), (second[0], second[1], second[2]), (third[0], third[1], third[2])
    return IntrinsicsForm(
        chosen.about, chosen.model, size_px, matrix_px, chosen.distortion, chosen.order, chosen.covariance
    )


def intrinsics_from_form(form: IntrinsicsForm | None) -> ChosenIntrinsics | None:
    """Convert intrinsics from their JSON form; None stays None."""
    if form is None:
        return None
    return ChosenIntrinsics(
        form.about, form.model, form.size_px, form.matrix_px, form.distortion, form.order, form.covariance
    )


def form_of_chosen(step: IntrinsicsChosen) -> IntrinsicsChosenForm:
    """Convert the step to its JSON form."""
    return IntrinsicsChosenForm(form_of_intrinsics(step.intrinsics))


def chosen_from_form(form: IntrinsicsChosenForm) -> IntrinsicsChosen:
    """Convert the step from its JSON form."""
    return IntrinsicsChosen(intrinsics_from_form(form.intrinsics))
