from .discretisation import Discretisation as Discretisation
from .export import write_state as write_state
from .fem.mesh import read_mesh as read_mesh
from .fem.mesh import write_mesh as write_mesh
from .model import Cells as Cells
from .model import Model as Model
from .model import Observer as Observer
from .model import Prediction as Prediction
