// File descriptors that are closed with their owner.
#pragma once
#include <fcntl.h>
#include <unistd.h>

#include <utility>

namespace defrec {

class Descriptor {
  public:
    Descriptor() = default;
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        Descriptor(std::move(other)).swap(*this);
        return *this;
    }
    ~Descriptor() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }

    int get() const { return descriptor_; }
    explicit operator bool() const { return descriptor_ >= 0; }
    void close() { Descriptor().swap(*this); }

  private:
    void swap(Descriptor& other) noexcept { std::swap(descriptor_, other.descriptor_); }
    int descriptor_ = -1;
};

// Not inherited by programs that are started. False, with errno, where there is none to be had.
struct Pipe {
    Descriptor read_end, write_end;
    bool open() {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) return false;
        read_end = Descriptor(ends[0]);
        write_end = Descriptor(ends[1]);
        return true;
    }
};

}  // namespace defrec
