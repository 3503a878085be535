// SPDX-License-Identifier: Apache-2.0
#include "paper/method.h"

namespace hpccd::paper {

std::unique_ptr<MethodEngine> engine_of(const Options& options, const Context& context) {
  if (options.method == Method::standard) return nullptr;
  // Which contact is found first depends on the order of the method: it could differ from the default's result.
  if (options.report == Report::any)
    throw InvalidArgument(
        "report: 'any' is offered by method 'default' only; leave the method as it is, or report 'all' or 'first'");
  if (options.method == Method::front) return front_based(context);
  return options.method == Method::naive ? naive(context, options.restructure)
                                         : published(context, options.restructure);
}

}  // namespace hpccd::paper
