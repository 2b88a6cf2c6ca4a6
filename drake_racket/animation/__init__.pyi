from .settings import AnimationSettings as AnimationSettings
from .write import animate as animate
