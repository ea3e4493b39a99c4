"""A ring on two piers: the taller they are, the more of them joins the mechanism.

@book{Heyman1995,
  author    = {Heyman, Jacques},
  title     = {The Stone Skeleton},
  publisher = {Cambridge University Press},
  year      = {1995}
}

Semicircle R = 3 m, t = 0.6 m, 15 voussoirs, on piers 1.2 m wide of 0.5 m courses, pushed sideways
without sliding. The factors are by linear programming of the static theorem.
"""

import pytest

import archfem as af

HALF_A_DIGIT = 5.1e-5


def structure(courses):
    return af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * courses
    )


@pytest.mark.parametrize(
    ("courses", "factor", "parts"),
    [
        (1, 0.2856, ["arch"] * 4),
        (4, 0.1415, ["arch"] * 3 + ["right pier"]),
        (12, 0.0263, ["arch"] * 3 + ["right pier"]),
    ],
)
def test_mechanism_changes_its_class(courses, factor, parts, verified):
    built = structure(courses)
    found = af.collapse_factor(built, live=af.BodyForce(1.0), friction=None)
    assert found.factor == pytest.approx(factor, abs=HALF_A_DIGIT)
    assert [built.joints[joint].part for joint, _ in found.hinges] == parts
    case = f"ring on piers of {0.5 * courses:g} m: horizontal acceleration [g]"
    verified(
        case, factor, "linear programme of the static theorem, apart from archfem", found.factor
    )
    if parts[-1] == "right pier":
        assert found.hinges[-1] == (len(built.joints) - 1, "extrados")  # the outer edge of its base
