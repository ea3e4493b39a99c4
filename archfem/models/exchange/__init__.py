"""States of a model as files of other programs."""
