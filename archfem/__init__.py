"""archfem: does a dry-stone arch or bridge survive an earthquake?"""

__version__ = "0.1.0"
