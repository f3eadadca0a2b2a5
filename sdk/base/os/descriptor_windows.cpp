// See descriptor.hpp.
#include <fcntl.h>
#include <io.h>

#include "sdk/base/os/descriptor.hpp"

namespace defrec {

Descriptor::~Descriptor() {
    if (descriptor_ >= 0) ::_close(descriptor_);
}

bool Pipe::open() {
    constexpr unsigned kBytes = 1 << 16;
    int ends[2];
    if (::_pipe(ends, kBytes, _O_BINARY | _O_NOINHERIT) != 0) return false;
    read_end = Descriptor(ends[0]);
    write_end = Descriptor(ends[1]);
    return true;
}

}  // namespace defrec
