// Makes the packets of hull_packets.h.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "input/hull_view.h"

namespace amhex {

// Of a hierarchy with triangles; the first packet holds the root. O(nodes). Throws RunStopped when
// `poll` does.
std::vector<HullPacket> PackHull(const HullView& hull, const StopPoll& poll = {});

}  // namespace amhex
