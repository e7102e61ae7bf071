// Walks the messages by reflection, so that a field added on one side only is noticed.
#include "convert.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <functional>

namespace amhex::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Calls `visit` with every scalar field of the message's groups and the group that holds it.
void ForEachField(Message* message,
                  const std::function<void(Message*, const FieldDescriptor*)>& visit) {
  const auto* descriptor = message->GetDescriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const FieldDescriptor* field = descriptor->field(i);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      ForEachField(message->GetReflection()->MutableMessage(message, field), visit);
    } else {
      visit(message, field);
    }
  }
}

// Sets a field to a value that differs from the one it has.
void Change(Message* message, const FieldDescriptor* field) {
  const auto* reflection = message->GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      reflection->SetInt32(message, field, reflection->GetInt32(*message, field) + 1);
      break;
    case FieldDescriptor::CPPTYPE_INT64:
      reflection->SetInt64(message, field, reflection->GetInt64(*message, field) + 1);
      break;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      reflection->SetDouble(message, field, reflection->GetDouble(*message, field) + 0.125);
      break;
    case FieldDescriptor::CPPTYPE_ENUM: {
      const int last = field->enum_type()->value_count() - 1;
      reflection->SetEnumValue(message, field, field->enum_type()->value(last)->number());
      break;
    }
    default:
      FAIL() << field->full_name() << " has a type this test does not know";
  }
}

TEST(ConvertParams, EveryFieldHasADefaultFromTheEngine) {
  amhex::v1::MeshingParams defaults = ToProto(MeshingParams());
  ForEachField(&defaults, [](Message* message, const FieldDescriptor* field) {
    EXPECT_TRUE(message->GetReflection()->HasField(*message, field)) << field->full_name();
  });
}

TEST(ConvertParams, AbsentFieldsTakeTheEnginesDefaults) {
  EXPECT_EQ(ToProto(ToEngine(amhex::v1::MeshingParams())).SerializeAsString(),
            ToProto(MeshingParams()).SerializeAsString());
}

TEST(ConvertParams, EveryChangedFieldSurvivesTheWayThroughTheEngine) {
  amhex::v1::MeshingParams changed = ToProto(MeshingParams());
  ForEachField(&changed, Change);
  EXPECT_EQ(ToProto(ToEngine(changed)).SerializeAsString(), changed.SerializeAsString());
}

TEST(ConvertParams, EveryFieldAloneChangesWhatTheEngineGets) {
  int field_count = 0;
  amhex::v1::MeshingParams shape = ToProto(MeshingParams());
  ForEachField(&shape, [&field_count](Message*, const FieldDescriptor*) { ++field_count; });
  for (int chosen = 0; chosen < field_count; ++chosen) {
    amhex::v1::MeshingParams one = ToProto(MeshingParams());
    int index = 0;
    std::string name;
    ForEachField(&one, [&](Message* message, const FieldDescriptor* field) {
      if (index++ != chosen) return;
      name = field->full_name();
      Change(message, field);
    });
    EXPECT_NE(ToProto(ToEngine(one)).SerializeAsString(),
              ToProto(MeshingParams()).SerializeAsString())
        << name;
  }
}

TEST(ConvertParams, UnknownEnumValuesAndNegativeSeedsAreNamed) {
  amhex::v1::MeshingParams params;
  params.mutable_run()->set_backend(static_cast<amhex::v1::Backend>(99));
  params.mutable_relaxation()->set_initialization(static_cast<amhex::v1::Initialization>(99));
  params.mutable_run()->set_seed(-1);
  EXPECT_EQ(UnknownValues(params).size(), 3u);
  EXPECT_TRUE(UnknownValues(amhex::v1::MeshingParams()).empty());
}

TEST(ConvertStage, EveryEngineStageHasTheSameNameInTheProto) {
  for (int i = 0; i < kStageCount; ++i) {
    const auto stage = static_cast<Stage>(i);
    std::string name = std::string("STAGE_") + StageName(stage);
    for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    EXPECT_EQ(amhex::v1::Stage_Name(ToProto(stage)), name);
  }
}

TEST(ConvertProgress, EveryFieldButTheRemainingTimeIsFilled) {
  Progress progress;
  progress.stage = Stage::kAssemble;
  progress.stage_fraction = progress.mean_movement = 1;
  progress.iteration = progress.iteration_count = 1;
  progress.site_count = progress.cell_count = 1;
  progress.cells_by_type.fill(1);
  progress.min_scaled_jacobian = progress.average_scaled_jacobian = 1;
  const amhex::v1::Progress proto = ToProto(progress);
  std::vector<const FieldDescriptor*> set;
  proto.GetReflection()->ListFields(proto, &set);
  // How long it still takes is known to the worker, not to the engine.
  EXPECT_EQ(static_cast<int>(set.size()), proto.GetDescriptor()->field_count() - 1);
  EXPECT_EQ(proto.cells_by_type_size(), 6);
}

TEST(ConvertStatistics, EveryFieldIsFilled) {
  MeshStatistics statistics;
  statistics.cell_count = statistics.vertex_count = statistics.boundary_face_count = 1;
  statistics.cells_by_type.fill(1);
  statistics.hexahedra_ratio = statistics.hexahedra_volume_ratio = 1;
  statistics.min_scaled_jacobian = statistics.average_scaled_jacobian = 1;
  statistics.min_scaled_jacobian_hexahedra = statistics.average_scaled_jacobian_hexahedra = 1;
  statistics.volume = statistics.hull_volume = 1;
  statistics.mesh_to_input_max = statistics.input_to_mesh_max = 1;
  statistics.input_to_mesh_mean = statistics.edge_length = 1;
  statistics.boundary_component_count = statistics.genus = 1;
  statistics.distance_exceeds_cell = true;
  statistics.sharp_edge_deviation_rms = statistics.sharp_edge_deviation_max = 1;
  statistics.shortest_edge = 1;
  const amhex::v1::MeshStatistics proto = ToProto(statistics);
  std::vector<const FieldDescriptor*> set;
  proto.GetReflection()->ListFields(proto, &set);
  EXPECT_EQ(static_cast<int>(set.size()), proto.GetDescriptor()->field_count());
  EXPECT_EQ(proto.cells_by_type_size(), 6);
}

TEST(ConvertStatistics, CellTypesKeepThePapersNumbers) {
  MeshStatistics statistics;
  statistics.cells_by_type[8] = 5;
  const amhex::v1::MeshStatistics proto = ToProto(statistics);
  ASSERT_EQ(proto.cells_by_type_size(), 1);
  EXPECT_EQ(proto.cells_by_type(0).type(), amhex::v1::CELL_TYPE_HEXAHEDRON);
}

}  // namespace
}  // namespace amhex::server
