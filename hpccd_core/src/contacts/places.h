// SPDX-License-Identifier: Apache-2.0
// Outputs of contacts on request: points, normals, nearest points, vertices, weights and approach.
#pragma once

#include "contacts/outputs.h"
#include "elementary/batch.h"
#include "elementary/pair.h"
#include "elementary/undecided.h"

namespace hpccd {

constexpr Outputs all_outputs{true, true, true, true, AtTime::contact};

// f(&Contacts::points) and so on for each output that is requested.
template <class F>
void for_each_output(Outputs outputs, F&& f) {
  if (outputs.points) f(&Contacts::points);
  if (outputs.normals) f(&Contacts::normals);
  if (outputs.closest) f(&Contacts::closest);
  if (!outputs.weights) return;
  f(&Contacts::vertices), f(&Contacts::weights);
  if (outputs.at == AtTime::contact) f(&Contacts::approach);
}

PairPlaces pair_places(const UndecidedPair& pair, double toc, Outputs outputs);

// Writes to entry i of lists that are large enough.
void write_places(Contacts& contacts, std::size_t i, const UndecidedPair& pair, double toc, Outputs outputs);
void write_places(Contacts& contacts, std::size_t i, const Candidate& pair, double toc, const Geometry& geometry,
                  Outputs outputs);

}  // namespace hpccd
