"""Conditions of the schedule in the looped engine's C."""

from __future__ import annotations

from .slot_storage import pass_variables, reads_variable

#: C conditions of the traits.
_TRAIT_TEXTS = {
    "own": "!(body->generic || state->required)",
    "parts": "(body->generic || state->required)", "section": "body->section",
    "whole": "body->kernels->body_motion && !body->section"
    " && (body->generic || state->required)",
    "directed": "body->kernels->directions && !body->placed && speeds == body->nu",
    "outward": "body->section && !body->section->inward", "modal": "body->modal",
    "imposed": "mstmm_imposed_count(body, state->memory)",
    "idle": "mstmm_idle(state->observed, body)",
    "drag": "body->modal && body->modal->drag", "inverse": "state->given",
    "weightless": "state->required",
    "balance": "state->balance", "efforts": "state->efforts", "known": "state->hinges_known",
    "linked": "state->linked", "laws": "model->n_laws", "driven": "model->n_drives",
    "expressions": "model->n_values",
    "flexible": "model->n_flexible", "poses": "(model->needs_pose || model->product)",
    "driving": "(!state->given || state->residual)", "curved": "!body->straight",
    "steady": "body->steady", "placed": "body->placed", "own_load": "load->own",
    "own_force": "force->own", "from_body": "force->body_f >= 0", "to_body": "force->body_t >= 0",
    "turning": "body->turning",
    "moving": "!body->section && speeds", "product": "model->product",
    "shifted": "state->tangents->shifted", "coordinate": "law->kind == 0",
    "looped": "model->looped", "cut": "looped->closure",
    "omitted": "mstmm_is_skipped(state->model, state->observed, index)",
    "corrected": "state->level",
    "residual": "state->residual",
    "loop_hinge": "state->model->looped[law->body].closure",
    "hinged": "closure->kind == MSTMM_HINGE",
    "distance": "closure->kind == MSTMM_DISTANCE", "plane": "closure->kind == MSTMM_PLANE",
    "rolling": "closure->kind == MSTMM_ROLLING",
    "soft": "(state->model->rows[closure->rows[c]].softness > 0)",
    "inside": "(row->body >= 0)", "refined": "state->refined", "couplings": "model->n_couplings",
    "redundant": "(coupling->row < 0)",
    "coupled": "(pending->tau >= 0)",
    "gap_closing": "(state->closing > 0)",
    "position_gap": "state->level == MSTMM_GAP", "velocity_error": "state->level == MSTMM_SLIP",
    "unit_load": "state->tangents->unit",
    "effort": "force->effort", "qr": "model->qr",
    "rigid": "body->kernels->rigid",
    "on_body": "(body->parent >= 0)", "loads_read": "(state->observed || state->balance)",
}  # fmt: skip


#: Traits with another condition for planar scenes.
_PLANAR_TRAIT_TEXTS = {"omitted": "body->omitted", "idle": "body->idle"}


def condition_text(when: str, flat: bool = False) -> str:
    """C expression of a condition.  Raises ValueError for an unknown condition."""
    terms = []
    for name in when.split():
        text = _trait_text(name, flat)
        simple = "&&" not in text and "==" not in text
        if name.startswith("!"):
            opposite = text[1:] if text.startswith("!") else f"!{text}"
            text = opposite if simple else f"!({text})"
        terms.append(text)
    return " && ".join(terms)


def condition_variables(when: str, flat: bool = False) -> set[str]:
    """Variables that a condition reads."""
    texts = [_trait_text(item, flat) for item in when.split()]
    return {name for name in pass_variables(flat) for text in texts if reads_variable(text, name)}


def _trait_text(word: str, flat: bool) -> str:
    trait = word.lstrip("!")
    text = (_PLANAR_TRAIT_TEXTS.get(trait) if flat else None) or _TRAIT_TEXTS.get(trait)
    if text is None:
        raise ValueError(f"unknown condition {word!r}; expected one of {', '.join(_TRAIT_TEXTS)}")
    return text
