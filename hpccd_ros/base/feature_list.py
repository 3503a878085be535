# SPDX-License-Identifier: Apache-2.0
"""The argument of commands for the tested features."""

import argparse


def feature_list(text: str) -> tuple[str, ...]:
    """KIND[,KIND] as names of features. Raises argparse.ArgumentTypeError."""
    from hpccd_core import arguments  # numpy comes with it, which --help can do without

    try:
        return arguments.feature_names(text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix("features: ")) from None
