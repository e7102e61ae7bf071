// How long tasks have taken on the device, for the reports of stages.
#pragma once

namespace amhex {

// Of those that this thread has asked for, copies and waiting included, since it began. A stage
// asks from one thread, so that what has been added when it ends is its own.
double DeviceSecondsOfThread();

}  // namespace amhex
