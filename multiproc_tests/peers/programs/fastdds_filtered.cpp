// A peer over Debian's Fast DDS 2.9 (C++) that filters: publishes shapes, or subscribes those that pass an expression.
//
//     fastdds_filtered pub ADDRESS COUNT
//     fastdds_filtered sub ADDRESS COUNT EXPRESSION [PARAMETER...] [-- PARAMETER...]
//
// What stands behind "--" are the parameters once it reads "change" on its input.  Its type is a dynamic one, as Fast DDS
// evaluates expressions by TypeObjects.  The one interface is that of the address.  Events: MATCHED n, WROTE color x,
// SAMPLE color x, DISPOSED, CHANGED, ACKED, DONE.
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/ContentFilteredTopic.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/types/DynamicData.h>
#include <fastrtps/types/DynamicDataFactory.h>
#include <fastrtps/types/DynamicPubSubType.h>
#include <fastrtps/types/DynamicTypeBuilder.h>
#include <fastrtps/types/DynamicTypeBuilderFactory.h>
#include <fastrtps/types/DynamicTypeBuilderPtr.h>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::types;
using Words = std::vector<std::string>;

static const int WAIT_S = 20;

static void say(const std::string& line)
{
    std::cout << line << std::endl;
}

template<class T>
static T* checked(const char* what, T* entity)
{
    if (entity == nullptr)
    {
        say(std::string("ERROR ") + what + " could not be made");
        _exit(2);
    }
    return entity;
}

static void sleep_ms(int milliseconds)
{
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

static DynamicType_ptr shape_type()
{
    auto* factory = DynamicTypeBuilderFactory::get_instance();
    DynamicTypeBuilder_ptr builder = factory->create_struct_builder();
    builder->set_name("ShapeType");
    builder->add_member(0, "color", factory->create_string_type(128));
    builder->add_member(1, "x", factory->create_int32_type());
    builder->add_member(2, "y", factory->create_int32_type());
    builder->add_member(3, "shapesize", factory->create_int32_type());
    builder->apply_annotation_to_member(0, ANNOTATION_KEY_ID, "value", "true");
    return builder->build();
}

static DomainParticipant* participant_at(const std::string& address)
{
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back(address);
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    return checked("participant", DomainParticipantFactory::get_instance()->create_participant(0, qos));
}

template<class Qos>
static void set_endpoint(Qos& qos)
{
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = KEEP_ALL_HISTORY_QOS;
}

static int publish(DomainParticipant* participant, Topic* topic, const DynamicType_ptr& type, int count)
{
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    set_endpoint(qos);
    qos.reliable_writer_qos().times.heartbeatPeriod = {0, 200000000};
    Publisher* publisher = checked("publisher", participant->create_publisher(PUBLISHER_QOS_DEFAULT));
    DataWriter* writer = checked("writer", publisher->create_datawriter(topic, qos));
    PublicationMatchedStatus status;
    for (int t = 0; t < WAIT_S * 100 && status.current_count < 1; ++t)
    {
        writer->get_publication_matched_status(status);
        sleep_ms(10);
    }
    say("MATCHED " + std::to_string(status.current_count));
    DynamicData* data = DynamicDataFactory::get_instance()->create_data(type);
    int x = 0;
    std::string command;
    while (std::getline(std::cin, command) && command == "write")
    {
        for (int end = x + count; x < end; ++x)
        {
            const char* color = x % 2 ? "RED" : "BLUE";
            data->set_string_value(color, 0);
            data->set_int32_value(x, 1);
            data->set_int32_value(2 * x, 2);
            data->set_int32_value(x % 10, 3);
            if (!writer->write(data))
            {
                say("ERROR write");
                return 2;
            }
            say(std::string("WROTE ") + color + " " + std::to_string(x));
            sleep_ms(5);
        }
        say(writer->wait_for_acknowledgments({WAIT_S, 0}) == ReturnCode_t::RETCODE_OK ? "ACKED" : "NOT-ACKED");
    }
    say("DONE");
    return 0;
}

static int subscribe(DomainParticipant* participant, Topic* topic, const DynamicType_ptr& type, const Words& words)
{
    Words first, later;
    for (size_t i = 1; i < words.size(); ++i)
    {
        static bool is_later = false;
        if (words[i] == "--")
        {
            is_later = true;
            continue;
        }
        (is_later ? later : first).push_back(words[i]);
    }
    ContentFilteredTopic* filtered = checked("content-filtered topic",
                    participant->create_contentfilteredtopic("Filtered", topic, words[0], first));
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    set_endpoint(qos);
    Subscriber* subscriber = checked("subscriber", participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT));
    DataReader* reader = checked("reader", subscriber->create_datareader(filtered, qos));
    std::thread commands([&]()
            {
                std::string command;
                while (std::getline(std::cin, command) && command == "change")
                {
                    bool is_set = filtered->set_expression_parameters(later) == ReturnCode_t::RETCODE_OK;
                    say(is_set ? "CHANGED" : "ERROR parameters");
                }
                say("DONE");
                _exit(0);
            });
    DynamicData* data = DynamicDataFactory::get_instance()->create_data(type);
    int matched = 0;
    while (true)
    {
        SubscriptionMatchedStatus status;
        reader->get_subscription_matched_status(status);
        if (status.current_count != matched)
        {
            say("MATCHED " + std::to_string(matched = status.current_count));
        }
        SampleInfo info;
        if (reader->take_next_sample(data, &info) != ReturnCode_t::RETCODE_OK)
        {
            sleep_ms(5);
        }
        else if (info.valid_data)
        {
            say("SAMPLE " + data->get_string_value(0) + " " + std::to_string(data->get_int32_value(1)));
        }
        else
        {
            say("DISPOSED");
        }
    }
}

int main(int argc, char** argv)
{
    if (argc < 4)
    {
        say("ERROR the arguments are: pub|sub ADDRESS COUNT [EXPRESSION [PARAMETER...]]");
        return 2;
    }
    DynamicType_ptr type = shape_type();
    TypeSupport support(new DynamicPubSubType(type));
    support->auto_fill_type_information(false);
    support->auto_fill_type_object(true);
    DomainParticipant* participant = participant_at(argv[2]);
    support.register_type(participant);
    Topic* topic = checked("topic", participant->create_topic("Square", "ShapeType", TOPIC_QOS_DEFAULT));
    if (std::string(argv[1]) == "pub")
    {
        return publish(participant, topic, type, std::stoi(argv[3]));
    }
    return subscribe(participant, topic, type, Words(argv + 4, argv + argc));
}
