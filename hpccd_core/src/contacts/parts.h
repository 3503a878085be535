// SPDX-License-Identifier: Apache-2.0
// Merges the contacts of the parts of a step into the contacts of the step.
#pragma once

#include <span>

#include "hpccd/results.h"

namespace hpccd {

// What Contacts hold, where somebody else keeps it, of part number `part` of `parts` of equal duration.
struct ContactsOfPart {
  std::span<const std::array<std::uint32_t, 2>> vf;
  std::span<const double> vf_toc;
  std::span<const std::array<std::uint32_t, 4>> ee;
  std::span<const double> ee_toc;
  std::span<const std::array<double, 3>> points, normals;
  std::span<const std::array<std::array<double, 3>, 2>> closest;
  double part = 0, parts = 1;
};

// Each pair once, as the first of the answers tells it, with its toc as a time of the step; of one world each, and in
// the order of Contacts, which this is too. Throws InvalidArgument where an answer has fewer rows of one kind than of
// another.
Contacts contacts_of_step(std::span<const ContactsOfPart> answers);

// As Contacts::hash of these, whatever their part.
std::uint64_t hash_of_contacts(const ContactsOfPart& contacts);

}  // namespace hpccd
