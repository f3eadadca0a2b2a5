// See descriptor.hpp.
#include <fcntl.h>
#include <unistd.h>

#include "sdk/base/os/descriptor.hpp"

namespace defrec {

Descriptor::~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

bool Pipe::open() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return false;
    read_end = Descriptor(ends[0]);
    write_end = Descriptor(ends[1]);
    return true;
}

}  // namespace defrec
