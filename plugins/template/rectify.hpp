// Stage rectify as its definition has it (docs/stages/rectify.md): a gray image, sampled through a
// map, and the mask of what may be used of it. Integer throughout, so its bytes are those of every
// other backend.
#pragma once
#include <defrec_plugin.h>

namespace example {

// The result of a check: DEFREC_OK, or a status and the error message for the host.
struct Verdict {
    defrec_status status;
    const char* text;
};
Verdict check_rectify(const defrec_rectify_params& params);

// What one run reads and writes; sizes are in the definition.
struct RectifyImages {
    const uint8_t* source;
    const int32_t* map;     // nullptr: not given
    const uint8_t* ignore;  // nullptr: not given
    uint8_t* gray;
    uint8_t* mask;
};
uint64_t rectify_source_bytes(const defrec_rectify_params& params);
uint64_t rectify_map_bytes(const defrec_rectify_params& params);
uint64_t rectify_ignore_bytes(const defrec_rectify_params& params);
uint64_t rectify_result_bytes(const defrec_rectify_params& params);
// Memory that a run works in.
uint64_t rectify_scratch_bytes(const defrec_rectify_params& params);

// Computes gray and mask, on the host's threads. Does not allocate and does not throw.
void rectify(const defrec_rectify_params& params, const defrec_host& host,
             const RectifyImages& images, uint8_t* scratch);

}  // namespace example
