from .published import PublishedValue as PublishedValue
from .published import load_published as load_published
from .rows import Comparison as Comparison
from .rows import compare as compare
from .run import SECTIONS as SECTIONS
from .run import validate as validate
