from .cells import Cells as Cells
from .discretisation import Discretisation as Discretisation
from .model import Model as Model
from .model import Prediction as Prediction
