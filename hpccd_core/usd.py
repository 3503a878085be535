# SPDX-License-Identifier: Apache-2.0
"""Contacts as points of a USD file, for Houdini, Blender, Maya, Omniverse and usdview."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .contacts import Contacts
from .worlds import KIND_NAMES, PAIR_KINDS

_KINDS = {kind: number for number, kind in enumerate(PAIR_KINDS)}
_NOWHERE = np.zeros(3, np.float32), np.zeros(3, np.float32)


def export_contacts(
    path: str | os.PathLike[str],
    contacts: Contacts | Sequence[Contacts],
    *,
    time_codes: Sequence[float] | None = None,
    prim: str = "/Contacts",
    width: float = 0.01,
    up_axis: str = "Z",
    meters_per_unit: float = 1.0,
) -> None:
    """Write contacts to a USD file as one UsdGeom.Points.

    Parameters
    ----------
    path : path
        A new file, or one to replace: .usda (text), .usdc or .usd.
    contacts : Contacts or sequence of Contacts
        Those of one step, or of T steps, one for each time sample. The detector needs outputs=("points", "normals").
    time_codes : sequence of float, shape (T,), optional
        Increasing. Where each step is written; by default 0, 1, ..., the number of the frame in which the step starts.
    prim : str
        Path of the points on the stage.
    width : float
        Diameter of the points on the screen, in the unit of the coordinates.
    up_axis : {"Y", "Z"}
        Upward axis of the stage. Positions are written as they are.
    meters_per_unit : float
        Unit of the coordinates in metres, for the stage.

    Raises
    ------
    TypeError, ValueError
        If an argument is invalid.
    OutputNotComputed
        If the contacts have no points or normals.
    OSError
        If the file cannot be written.
    ModuleNotFoundError
        If usd-core is not installed.

    Notes
    -----
    Attributes, one value for each contact, rounded to float32 as USD stores points: `points`, `normals`, `widths`, and
    the primvars `toc` (float, time of impact), `displayColor` (from blue at time 0 to red at 1), `kind` (int, an index
    into the constant primvar `kindNames`), `meshA` and `meshB` (int, indices into `meshNames`), `features` (int[4],
    the row of `Contacts.vf`, `ee` and so on, with -1 behind it), `world` (int).

    Readers interpolate between time samples if two steps have the same number of contacts: evaluate at the time codes.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import hpccd_core as hc
    >>> from hpccd_core.usd import export_contacts
    >>> vertices, faces = hc.shapes.icosphere(2)
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("ball", faces), scene.add_plane("floor")
    >>> detector = hc.Detector(scene, outputs=("points", "normals"))
    >>> heights = (1.5, 1.25, 1.0, 0.75)
    >>> steps = [detector.step(vertices + [0, 0, z]) for z in heights][1:]
    >>> [len(step) for step in steps]
    [0, 1, 7]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "contacts.usda")
    ...     export_contacts(path, steps, time_codes=[1, 2, 3])
    ...     "2: [(0, 0, 0)]" in path.read_text()
    True
    """
    Gf, Sdf, Usd, UsdGeom, Vt = _pxr("Gf", "Sdf", "Usd", "UsdGeom", "Vt")
    given: Any = contacts
    steps = list(given) if isinstance(given, Iterable) and not hasattr(given, "layout") else [given]
    codes = _time_codes(time_codes, len(steps))
    columns = [_columns(step) for step in steps]
    arguments.choice("up_axis", up_axis, ("Y", "Z"))
    width, unit = arguments.length("width", width), arguments.length("meters_per_unit", meters_per_unit)
    if not unit:
        raise ValueError("meters_per_unit: must be greater than 0; give 0.01 for centimetres")
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path: expected the name of a file, got {type(path).__name__}")
    arguments.text("prim", prim)
    target = Path(path)
    if target.suffix not in (".usd", ".usda", ".usdc"):
        raise ValueError(f"path: {target.name!r} is no USD file; use the ending .usda, .usdc or .usd")
    if not Sdf.Path.IsValidPathString(prim) or not Sdf.Path(prim).IsPrimPath() or prim[0] != "/":
        raise ValueError(f"prim: {prim!r} is no path of a prim; give one such as '/Contacts'")

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, up_axis)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    points = UsdGeom.Points.Define(stage, prim)
    stage.SetDefaultPrim(stage.GetPrimAtPath(Sdf.Path(prim).GetPrefixes()[0]))
    if codes:
        stage.SetStartTimeCode(codes[0])
        stage.SetEndTimeCode(codes[-1])
    points.CreateWidthsAttr([width])
    points.SetWidthsInterpolation("constant")
    points.SetNormalsInterpolation("vertex")
    primvars, types = UsdGeom.PrimvarsAPI(points), Sdf.ValueTypeNames
    layout = next((step.layout for step in steps if step.layout is not None), None)
    for name, words in (("kindNames", list(KIND_NAMES.values())), ("meshNames", layout and list(layout.mesh_names))):
        primvars.CreatePrimvar(name, types.StringArray, "constant").Set(words or [])
    written = {name: primvars.CreatePrimvar(name, types.IntArray, "vertex") for name in ("kind", "meshA", "meshB")}
    written["world"] = primvars.CreatePrimvar("world", types.IntArray, "vertex")
    written["features"] = primvars.CreatePrimvar("features", types.IntArray, "vertex", 4)
    written["toc"] = primvars.CreatePrimvar("toc", types.FloatArray, "vertex")
    written["displayColor"] = primvars.CreatePrimvar("displayColor", types.Color3fArray, "vertex")
    written |= {"points": points.CreatePointsAttr(), "normals": points.CreateNormalsAttr()}
    for code, of_step in zip(codes, columns, strict=True):
        for name, attribute in written.items():
            values = of_step[name]
            convert = Vt.Vec3fArray if values.ndim == 2 else Vt.IntArray if values.dtype == np.int32 else Vt.FloatArray
            attribute.Set(convert.FromNumpy(values), code)
        half = Gf.Vec3f(width / 2)
        low, high = (f(of_step["points"], axis=0) for f in (np.min, np.max)) if len(of_step["points"]) else _NOWHERE
        points.CreateExtentAttr().Set([Gf.Vec3f(*low.tolist()) - half, Gf.Vec3f(*high.tolist()) + half], code)
    _write(stage, target)


def _columns(contacts: Contacts) -> dict[str, NDArray[Any]]:
    """The values of each attribute of a step."""
    if not isinstance(contacts, Contacts):
        remedy = "; copy it first, with to_host()" if hasattr(contacts, "to_host") else ""
        raise TypeError(f"contacts: expected hpccd_core.Contacts or several, got {type(contacts).__name__}{remedy}")
    floats: dict[str, NDArray[Any]] = {"points": contacts.points, "normals": contacts.normals}
    kinds = contacts._kinds()
    rows = [getattr(contacts, kind) for kind in kinds]
    n = sum(map(len, rows))
    features = np.full((n, 4), -1, np.int32)
    begin = 0
    for of_kind in rows:
        features[begin : begin + len(of_kind), : of_kind.shape[1]] = of_kind
        begin += len(of_kind)
    toc = contacts._values("toc").astype(np.float32)
    colour = np.stack([toc, np.full(n, 0.2, np.float32), 1 - toc], axis=1)
    integers = {
        "kind": np.repeat([_KINDS[kind] for kind in kinds], [len(of_kind) for of_kind in rows]),
        "meshA": contacts.mesh_a[:n],
        "meshB": contacts.mesh_b[:n],
        "world": contacts._worlds_of_rows(),
        "features": features.ravel(),
    }
    floats |= {"toc": toc, "displayColor": colour}
    found: dict[str, NDArray[Any]] = {name: np.ascontiguousarray(a, np.int32) for name, a in integers.items()}
    with np.errstate(over="ignore"):
        found |= {name: np.ascontiguousarray(a, np.float32) for name, a in floats.items()}
    if not np.isfinite(found["points"]).all():
        raise ValueError("contacts: USD stores points as float32, and these are beyond 3.4e38; scale the scene down")
    return found


def _time_codes(given: Sequence[float] | None, n: int) -> list[float]:
    if given is None:
        return [float(k) for k in range(n)]
    if not isinstance(given, Iterable):
        raise TypeError(f"time_codes: expected {n} numbers, one for each step, got {type(given).__name__}")
    codes = [arguments.real(f"time_codes[{k}]", code) for k, code in enumerate(given)]
    if not np.isfinite(codes).all():
        raise ValueError("time_codes: must be finite")
    if len(codes) != n:
        raise ValueError(f"time_codes: expected {n}, one for each step, got {len(codes)}")
    if not all(a < b for a, b in zip(codes, codes[1:], strict=False)):
        raise ValueError("time_codes: must increase from step to step")
    return codes


def _write(stage: Any, path: Path) -> None:
    (Tf,) = _pxr("Tf")
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(f"path: the folder {path.parent} does not exist; create it first")
    try:
        done = stage.GetRootLayer().Export(str(path))
    except Tf.ErrorException as error:
        raise OSError(f"path: cannot write {path} ({str(error).strip()})") from None
    if not done:
        raise OSError(f"path: cannot write {path}")


def _pxr(*names: str) -> list[ModuleType]:
    try:
        import pxr  # noqa: F401
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"hpccd_core.usd: cannot import pxr ({error}); pip install 'hpccd-core[usd]'", name=error.name
        ) from None
    return [importlib.import_module(f"pxr.{name}") for name in names]
