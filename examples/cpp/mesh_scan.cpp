// mesh_scan SERVER SCAN.drc: sends a Draco file to a server and prints what comes back.
#include <fstream>
#include <iostream>
#include <iterator>

#include "amhex/client.h"
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::ifstream file(argv[2], std::ios::binary);
  amhex::client::EncodedInput input;  // Draco unless said otherwise
  input.bytes.assign(std::istreambuf_iterator<char>(file), {});

  amhex::client::Client client({.address = argv[1]});
  amhex::v1::MeshingParams params;
  params.mutable_sizing()->set_cell_count(1000);
  auto job = client.Submit(input, params);
  if (job.ok()) job = client.Watch(job->name(), {});
  absl::Status status = job.ok() ? amhex::client::ErrorOf(*job) : job.status();
  if (!status.ok()) return std::cerr << status << "\n", 1;

  const auto mesh = client.FetchMesh(job->result());
  if (!mesh.ok()) return std::cerr << mesh.status() << "\n", 1;
  std::cout << mesh->corners.size() << " cells, " << mesh->vertices.size() << " vertices\n";
}
