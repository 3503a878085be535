// SPDX-License-Identifier: Apache-2.0
// Merges the contacts of the parts of a step into the contacts of the step.
#pragma once

#include <span>

#include "hpccd/results.h"

namespace hpccd {

// The arrays of Contacts, owned by the caller, of part number `part` of `parts` parts of equal duration.
struct ContactsOfPart {
  std::span<const std::array<std::uint32_t, 2>> vf;
  std::span<const double> vf_toc;
  std::span<const std::array<std::uint32_t, 4>> ee;
  std::span<const double> ee_toc;
  std::span<const std::array<std::uint32_t, 2>> vp;
  std::span<const double> vp_toc;
  std::span<const std::array<std::uint32_t, 2>> vv;
  std::span<const double> vv_toc;
  std::span<const std::array<std::uint32_t, 3>> ve;
  std::span<const double> ve_toc;
  std::span<const std::array<double, 3>> points, normals;
  std::span<const std::array<std::array<double, 3>, 2>> closest;
  std::span<const std::array<std::uint32_t, 4>> vertices;
  std::span<const std::array<double, 4>> weights;
  std::span<const double> approach;
  double part = 0, parts = 1;
};

// Each pair once, from the first part that contains it, with its toc as a time of the step, in the order of Contacts.
// Parts are of one world each. Throws InvalidArgument if the arrays of a part have different lengths.
Contacts contacts_of_step(std::span<const ContactsOfPart> answers);

// The value of Contacts::hash for these contacts; the part does not matter.
std::uint64_t hash_of_contacts(const ContactsOfPart& contacts);

}  // namespace hpccd
