// Why a registration may fail: units and axes that do not agree, as sizes and places tell.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sdk/io/mesh_file.hpp"
#include "sdk/registration/program/inputs.hpp"

namespace defrec::cli {

struct GivenPlaces {
    const MeshFile* model = nullptr;  // mm, as it was compared; null: there is none
    std::span<const float> surface;   // xyz each, mm; empty: there is none
    const PairsFile* pairs = nullptr;
};
// One sentence each; empty where nothing is known.
std::vector<std::string> likely_causes(const GivenPlaces& given);

}  // namespace defrec::cli
