// Where in an image there is something to track.
#pragma once
#include <functional>
#include <vector>

#include "sdk/template/capture.hpp"

namespace defrec {

struct PatchPlace {
    int u, v;
};

// The most trackable pixel of each cell of a grid over the image; none in cells without texture.
// cell: side, px. border: px from the image's rim that are left out. is_wanted: whether a pixel
// counts.
std::vector<PatchPlace> trackable_places(const CaptureInput& input, double cell, int border,
                                         const std::function<bool(int u, int v)>& is_wanted);

// Side of the cells for input.max_patches of them over the image.
double patch_cell(const CaptureInput& input);

}  // namespace defrec
