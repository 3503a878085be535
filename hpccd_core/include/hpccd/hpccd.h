// SPDX-License-Identifier: Apache-2.0
/// \file
/// The complete public C++ interface of hpccd: continuous collision detection of deforming triangle meshes.
///
///     auto scene = std::make_shared<hpccd::Scene>();
///     scene->add_mesh("cloth", faces, n_vertices);
///     hpccd::Detector detector(scene, hpccd::Options{});
///     hpccd::Contacts contacts = detector.detect(hpccd::Positions::of(start), hpccd::Positions::of(end));
///
/// The library never prints and never ends the process; errors are exceptions. The soname (libhpccd_core.so.0.1) and
/// the inline namespace (hpccd::v0_1) identify the binary interface: a program compiled against another version does
/// not link or load.
#pragma once

#include "hpccd/contours.h"
#include "hpccd/detector.h"
#include "hpccd/elementary.h"
#include "hpccd/errors.h"
#include "hpccd/options.h"
#include "hpccd/positions.h"
#include "hpccd/prepared.h"
#include "hpccd/results.h"
#include "hpccd/scene.h"
#include "hpccd/version.h"
