from .cells import Cells as Cells
from .discretisation import Discretisation as Discretisation
from .exchange.states import write_state as write_state
from .fem.mesh import read_mesh as read_mesh
from .fem.mesh import write_mesh as write_mesh
from .gauges import Gauges as Gauges
from .model import Model as Model
from .model import Prediction as Prediction
