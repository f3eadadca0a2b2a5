// `defrec register`: a model's place in the template frame, with what is not known of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/io/mesh_file.hpp"

namespace defrec::cli {

struct RegisterOptions {
    std::string model, surface, pairs, targets, start, out, part;
    std::string seen_template;  // in place of surface: a file of `defrec track --save-template`
    bool is_by_pairs_alone = false;  // the model goes into the plan, and is compared with nothing
    std::string plan;                // file to write; empty: none
    bool is_looked_at = false;       // by a person: the plan is written although the verdict is not
                                     // registered, unless the registration has failed
    std::optional<MeshUnit> unit;
    std::optional<double> start_turn_degrees, start_shift_mm, point_error_mm, model_error_mm,
        max_residual_mm, max_error_mm;
    std::optional<std::uint32_t> starts;
    bool is_deformed = false;  // as an elastic body, where the surface says how
    std::optional<double> deformation_mm;
    bool is_tracked_camera = true;  // the camera stands in the origin of the surface's frame
    unsigned threads = 0;
    bool json = false, quiet = false;
};

// Returns the exit code: 0 where the model is registered, 9 where it is not.
int run_register(const RegisterOptions& options);

}  // namespace defrec::cli
