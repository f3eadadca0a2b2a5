// A page with the plots of a score: reliability, coverage and sparsification. It needs no script
// and no network.
#pragma once

#include <string>

#include "sdk/cli/score/score.hpp"

namespace defrec::cli {

// `folder` and `truth` are shown as what was compared.
std::string score_page(const Score& score, const std::string& folder, const std::string& truth);

}  // namespace defrec::cli
