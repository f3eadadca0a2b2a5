// What a stage of the CUDA backend looks like from outside.
#pragma once
#include "backends/cuda/device/device.hpp"
#include "backends/cuda/device/recorder.hpp"
#include "backends/shared/stage.hpp"

namespace defrec::cuda {

class Stage {
  public:
    virtual ~Stage() = default;
    // The inputs that stay the same from run to run, in host memory. May allocate, upload and wait;
    // no work of the stage is under way.
    virtual void prepare(std::span<const InBuffer>) {
        throw StageError(DEFREC_ERROR_ARGUMENT, "this stage has nothing to prepare");
    }
    // Checks the buffers, throws StageError, and records everything that one run does. The buffers'
    // data are addresses on the device: not to be looked at here. Called once for each set of
    // buffers (again after prepare); what it records may run many times.
    virtual void record(Recorder& recorder, std::span<const InBuffer> in,
                        std::span<const OutBuffer> out) = 0;
    // Whether two runs may go beside each other: the stage has no memory that a run writes.
    virtual bool reentrant() const { return false; }
};

}  // namespace defrec::cuda
