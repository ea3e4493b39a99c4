"""The protocol `Model`: functions that every fidelity provides, and objects that lack them."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import archfem as af
from archfem.models import Model, Prediction
from archfem.models.model import check_model


@pytest.fixture(params=["rigid", "faces", "condensed", "full", "monolithic"])
def model(request, stack):
    return af.build(stack, fidelity=request.param, cells=(2, 2))


def test_every_fidelity_provides_the_protocol(model):
    check_model(model)
    assert isinstance(model, Model)


def test_copies_leave_the_model_as_it_was(model):
    promise = Prediction(
        error=0.01,
        tolerance=0.02,
        dt=0.005,
        candidates=(),
    )
    assert model.with_prediction(promise).prediction is promise
    down = af.Settlement("base", (0.0, -0.1, 0.0))
    twice = model.settled(down).settled(down)
    assert twice.support_motion[0].tolist() == [0.0, -0.2, 0.0]
    assert model.prediction is None
    assert not model.support_motion.any()


@pytest.mark.parametrize("given", [None, SimpleNamespace(tangent=None, support_motion=None)])
def test_an_object_that_is_no_model_is_refused(stack, given):
    for each in (given, stack):
        with pytest.raises(af.InvalidInput, match=f"model is a {type(each).__name__}: build one"):
            check_model(each)


def test_a_prediction_in_words():
    prediction = Prediction(
        error=0.0049,
        tolerance=0.005,
        dt=0.0025,
        candidates=(("rigid", 0.02), ("faces", 0.0049)),
        small_displacement_error=0.003,
    )
    assert prediction.is_met
    assert not replace(prediction, error=0.0051).is_met
    assert not replace(prediction, small_displacement_error=0.0051).is_met
    assert prediction.text == (
        "predicted error 0.0049 in the largest |e| by model and steps of 2.5 ms, and 0.003 by the "
        "assumption of small displacements; tolerance 0.005 (tried: rigid: 0.02; faces: 0.0049)"
    )
