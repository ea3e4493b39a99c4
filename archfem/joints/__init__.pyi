from .criteria import Criteria as Criteria
from .criteria import flags as flags
from .criteria import judged as judged
from .operator import JointOperator as JointOperator
from .quadrature import Quadrature as Quadrature
from .resultants import joint_dataset as joint_dataset
from .resultants import one_joint as one_joint
from .resultants import thrust_line as thrust_line
