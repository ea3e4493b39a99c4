"""What was found, in words."""

import archfem as af
from archfem.cases.summary import collapse_words


def test_limit_analysis_in_words(ring):
    pushed = af.collapse_factor(ring, live=af.BodyForce(1.0))
    outcome, hinges = collapse_words(ring, pushed).splitlines()
    assert outcome.endswith(f"into a mechanism, at a factor of {pushed.factor:.4g} on the load")
    assert hinges.startswith("hinges, by the face in contact: joint 0 at the intrados, joint 6 at")
    slab = af.column(breadth=4.0, heights=[1.0])  # slides before it turns
    assert collapse_words(slab, af.collapse_factor(slab, live=af.BodyForce(1.0))).endswith(
        f"\nsliding: {slab.joints[0].name}"
    )
    lifted = af.collapse_factor(slab, live=af.BodyForce(0.0, -1.0))
    assert collapse_words(slab, lifted) == "limit analysis: this load never overturns it"
