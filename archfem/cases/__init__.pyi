from .case import Case as Case
from .study import Study as Study
