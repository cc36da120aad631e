"""The lens models by their names in venues."""

from collections.abc import Mapping

from worker.calibration.geometry.lens import Fisheye, Intrinsics, Lens, LensModel
from worker.calibration.geometry.panorama import Cylindrical, Equirectangular, Panorama

PANORAMAS: Mapping[LensModel, type[Panorama]] = {"cylindrical": Cylindrical, "equirectangular": Equirectangular}
LENSES: Mapping[LensModel, type[Lens]] = {"opencv": Intrinsics, "fisheye": Fisheye, **PANORAMAS}
