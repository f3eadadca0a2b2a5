// volk, the loader of Vulkan's functions, is compiled here: distributions ship it as source.
#define VOLK_IMPLEMENTATION
#include <volk.h>
