// Stages from parameters of which only those are set that differ from their defaults.
#pragma once
#include <memory>
#include <utility>

#include "sdk/contract/stage_params.hpp"
#include "sdk/device/device.hpp"

namespace defrec {

template <class Params>
Params make_params() {
    Params params;
    DEFREC_INIT(&params);
    return params;
}

template <uint32_t kStage, class Params>
std::unique_ptr<DeviceStage> make_stage(std::shared_ptr<const Device> device, Params params) {
    fill_defaults(params);
    return std::make_unique<DeviceStage>(std::move(device), kStage, &params);
}

}  // namespace defrec
