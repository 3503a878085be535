// SPDX-License-Identifier: Apache-2.0
/// \file
/// The public C++ interface of hpccd, all of it: continuous collision detection of deforming triangle meshes.
///
///     auto scene = std::make_shared<hpccd::Scene>();
///     scene->add_mesh("cloth", faces, n_vertices);
///     hpccd::Detector detector(scene, hpccd::Options{});
///     hpccd::Contacts contacts = detector.detect(hpccd::Positions::of(start), hpccd::Positions::of(end));
///
/// Nothing here prints or ends the process: errors are thrown. One soname (libhpccd_core.so.0.1) and one inline
/// namespace (hpccd::v0_1) stand for one binary interface: what was compiled against another is refused by the linker
/// and the loader, and never runs on types that have changed.
#pragma once

#include "hpccd/detector.h"
#include "hpccd/elementary.h"
#include "hpccd/errors.h"
#include "hpccd/options.h"
#include "hpccd/positions.h"
#include "hpccd/prepared.h"
#include "hpccd/results.h"
#include "hpccd/scene.h"
#include "hpccd/version.h"
