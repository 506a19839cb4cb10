// A peer over Debian's Fast DDS 2.9 (C++): publishes or subscribes shapes and blobs, one event a line.
// docs/multiproc.md has the command line and the events; the one interface is that of the address given (-a).
#include <chrono>
#include <map>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/publisher/qos/PublisherQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/subscriber/qos/SubscriberQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "fastdds_types.hpp"

using namespace eprosima::fastdds::dds;

static struct options o;

static void sleep_ms(int milliseconds)
{
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

template<class T>
static T* checked(const char* what, T* entity)
{
    if (entity == nullptr)
    {
        say("ERROR %s could not be made", what);
        _exit(2);
    }
    return entity;
}

static void checked(const char* what, ReturnCode_t code)
{
    if (code != ReturnCode_t::RETCODE_OK)
    {
        say("ERROR %s: return code %u", what, code());
        _exit(2);
    }
}

// --- samples ----------------------------------------------------------------------------------------

static void fill(Sample& s, int i)
{
    s.color = o.colors[i % o.color_count];
    s.x = i;
    s.y = 2 * i;
    s.shapesize = o.size;
    s.tint = static_cast<uint8_t>(i);
    s.angle = 0.5 * i;
    s.stamp = (static_cast<int64_t>(i) << 32) + 1;
    s.id = i;
    if (o.blob_octets >= 0)
    {
        s.data.resize(static_cast<size_t>(o.blob_octets));
        fill_blob(s.data.data(), s.data.size(), i);
    }
}

static void say_sample(const char* event, const Sample& s)
{
    if (o.blob_octets >= 0)
    {
        say("%s %d %zu %08x", event, s.id, s.data.size(), crc32_of(s.data.data(), s.data.size()));
        return;
    }
    if (o.appendable && (s.tint != static_cast<uint8_t>(s.x) || s.angle != 0.5 * s.x
            || s.stamp != (static_cast<int64_t>(s.x) << 32) + 1))
    {
        say("ERROR %s: tint %d angle %g stamp %lld", event, s.tint, s.angle, static_cast<long long>(s.stamp));
        _exit(2);
    }
    say("%s %s %d %d %d", event, s.color.c_str(), s.x, s.y, s.shapesize);
}

static std::string key_of(const Sample& s)
{
    return o.blob_octets >= 0 ? std::to_string(s.id) : s.color;
}

// --- qualities of service -----------------------------------------------------------------------------

// Reports what authentication says of other participants.
class Watcher : public DomainParticipantListener
{
public:

    void onParticipantAuthentication(DomainParticipant*, rtps::ParticipantAuthenticationInfo&& info) override
    {
        bool is_authorized = info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT;
        say(is_authorized ? "AUTHORIZED" : "UNAUTHORIZED");
    }
};

static void set_security(DomainParticipantQos& qos)
{
    auto& properties = qos.properties().properties();
    const std::string folder = std::string("file://") + o.store + "/", name = o.name;
    const std::string auth = "dds.sec.auth.builtin.PKI-DH.", access = "dds.sec.access.builtin.Access-Permissions.";
    properties.emplace_back("dds.sec.auth.plugin", "builtin.PKI-DH");
    properties.emplace_back("dds.sec.access.plugin", "builtin.Access-Permissions");
    properties.emplace_back("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
    properties.emplace_back(auth + "identity_ca", folder + "identity_ca.pem");
    properties.emplace_back(auth + "identity_certificate", folder + name + ".pem");
    properties.emplace_back(auth + "private_key", folder + name + ".key");
    properties.emplace_back(access + "permissions_ca", folder + "permissions_ca.pem");
    properties.emplace_back(access + "governance", folder + o.governance);
    properties.emplace_back(access + "permissions", folder + name + ".permissions.p7s");
    if (has_revocation_list(&o))
    {
        properties.emplace_back(auth + "identity_crl", folder + REVOCATION_LIST);
    }
}

// One UDP transport on one address: no shared memory, no other interface.
static void set_transport(DomainParticipantQos& qos)
{
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back(o.address);
    udp->receiveBufferSize = udp->sendBufferSize = 4 << 20;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    if (o.unicast)
    {
        rtps::Locator_t locator;
        rtps::IPLocator::setIPv4(locator, o.address);
        locator.port = 0; // stands for the ports of the first few participants
        qos.wire_protocol().builtin.initialPeersList.push_back(locator);
        qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(locator);
    }
}

template<class Qos>
static void set_endpoint(Qos& qos)
{
    qos.reliability().kind = o.best_effort ? BEST_EFFORT_RELIABILITY_QOS : RELIABLE_RELIABILITY_QOS;
    qos.reliability().max_blocking_time = {10, 0};
    qos.durability().kind = o.is_volatile ? VOLATILE_DURABILITY_QOS : TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = o.depth > 0 ? KEEP_LAST_HISTORY_QOS : KEEP_ALL_HISTORY_QOS;
    qos.history().depth = o.depth > 0 ? o.depth : 1;
    // Must be consistent (samples at least instances times samples of each), or there is no writer and no reason.
    qos.resource_limits().max_instances = 20;
    qos.resource_limits().max_samples_per_instance = 5000;
    qos.resource_limits().max_samples = 100000;
    if (o.max_samples > 0)
    {
        qos.resource_limits().max_instances = 1;
        qos.resource_limits().max_samples_per_instance = o.max_samples;
        qos.resource_limits().max_samples = o.max_samples;
        qos.resource_limits().allocated_samples = 0;
    }
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
}

template<class Qos>
static void set_partitions(Qos& qos)
{
    if (o.partitions != nullptr)
    {
        char* list = strdup(o.partitions);
        for (char* name = strtok(list, ","); name != nullptr; name = strtok(nullptr, ","))
        {
            qos.partition().push_back(name);
        }
    }
}

// --- the two roles ------------------------------------------------------------------------------------

static int publish(DomainParticipant* participant, Topic* topic)
{
    PublisherQos group = PUBLISHER_QOS_DEFAULT;
    set_partitions(group);
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    set_endpoint(qos);
    qos.writer_data_lifecycle().autodispose_unregistered_instances = false;
    qos.reliable_writer_qos().times.heartbeatPeriod = {0, 200000000}; // by default 3 s
    qos.publish_mode().kind = o.blob_octets >= 0 ? ASYNCHRONOUS_PUBLISH_MODE : SYNCHRONOUS_PUBLISH_MODE;
    Publisher* publisher = checked("publisher", participant->create_publisher(group));
    DataWriter* writer = checked("writer", publisher->create_datawriter(topic, qos));
    PublicationMatchedStatus status;
    for (int t = 0; t < o.wait_s * 100 && status.current_count < o.readers; ++t)
    {
        writer->get_publication_matched_status(status);
        sleep_ms(10);
    }
    if (status.current_count < o.readers)
    {
        say("TIMEOUT %d of %d readers", status.current_count, o.readers);
        return 1;
    }
    say("MATCHED %d", status.current_count);
    wait_at_gate(&o);
    Sample s;
    for (int i = 0; i < o.count; ++i)
    {
        fill(s, i);
        if (!writer->write(&s))
        {
            say("ERROR write");
            return 2;
        }
        say_sample("WROTE", s);
        sleep_ms(o.interval_ms);
    }
    if (o.dispose)
    {
        checked("dispose", writer->dispose(&s, rtps::c_InstanceHandle_Unknown));
        say("DISPOSED %s", key_of(s).c_str());
    }
    if (o.unregister)
    {
        checked("unregister", writer->unregister_instance(&s, rtps::c_InstanceHandle_Unknown));
        say("UNREGISTERED %s", key_of(s).c_str());
    }
    if (!o.best_effort)
    {
        say(writer->wait_for_acknowledgments({o.wait_s, 0}) == ReturnCode_t::RETCODE_OK ? "ACKED" : "NOT-ACKED");
    }
    leave_slowly(&o);
    say("DONE %d", o.count);
    return 0;
}

class Taker
{
public:

    explicit Taker(DataReader* reader)
        : reader_(reader)
    {
    }

    bool is_complete() const
    {
        return samples_ >= o.count && (!o.dispose || has_disposed_) && (!o.unregister || has_no_writers_);
    }

    int samples() const
    {
        return samples_;
    }

    // Takes what is there and says it, or waits a little.
    void take_some()
    {
        SubscriptionMatchedStatus status;
        reader_->get_subscription_matched_status(status);
        if (status.current_count != matched_)
        {
            say("MATCHED %d", matched_ = status.current_count);
        }
        Sample s;
        SampleInfo info;
        if (reader_->take_next_sample(&s, &info) != ReturnCode_t::RETCODE_OK)
        {
            sleep_ms(5);
        }
        else if (info.valid_data)
        {
            // What says that an instance is gone comes with empty key fields: its key is known by its handle.
            keys_[info.instance_handle] = key_of(s);
            say_sample("SAMPLE", s);
            ++samples_;
            sleep_ms(o.read_pause_ms);
        }
        else if (info.instance_state == NOT_ALIVE_DISPOSED_INSTANCE_STATE)
        {
            say("DISPOSED %s", known_key(info.instance_handle).c_str());
            has_disposed_ = true;
        }
        else
        {
            say("NO-WRITERS %s", known_key(info.instance_handle).c_str());
            has_no_writers_ = true;
        }
    }

private:

    std::string known_key(const InstanceHandle_t& handle) const
    {
        auto found = keys_.find(handle);
        return found == keys_.end() ? "?" : found->second;
    }

    DataReader* reader_;
    int matched_ = 0, samples_ = 0;
    bool has_disposed_ = false, has_no_writers_ = false;
    std::map<InstanceHandle_t, std::string> keys_;
};

static int subscribe(DomainParticipant* participant, Topic* topic)
{
    SubscriberQos group = SUBSCRIBER_QOS_DEFAULT;
    set_partitions(group);
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    set_endpoint(qos);
    Subscriber* subscriber = checked("subscriber", participant->create_subscriber(group));
    Taker taker(checked("reader", subscriber->create_datareader(topic, qos)));
    using clock = std::chrono::steady_clock;
    auto end = clock::now() + std::chrono::seconds(o.wait_s);
    while (!taker.is_complete() && clock::now() < end)
    {
        taker.take_some();
    }
    if (!taker.is_complete())
    {
        say("TIMEOUT %d of %d", taker.samples(), o.count);
        return 1;
    }
    if (o.hold)
    {
        say("HOLDING");
    }
    end = clock::now() + std::chrono::milliseconds(o.linger_ms);
    while (o.hold ? !is_released() : clock::now() < end) // what still comes is too much, and said
    {
        taker.take_some();
    }
    say("DONE %d", taker.samples());
    return 0;
}

int main(int argc, char** argv)
{
    o = parse_options(argc, argv);
    if (o.representation == 2)
    {
        say("ERROR Fast DDS 2.9 has no XCDR2");
        return 2;
    }
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    qos.name(o.name);
    if (o.lease_s > 0)
    {
        auto& discovery = qos.wire_protocol().builtin.discovery_config;
        discovery.leaseDuration = {o.lease_s, 0};
        discovery.leaseDuration_announcementperiod = {0, 1000000000u / 4 * 3};
    }
    set_transport(qos);
    if (o.store != nullptr)
    {
        set_security(qos);
    }
    static Watcher watcher;
    DomainParticipantFactory* factory = DomainParticipantFactory::get_instance();
    DomainParticipant* participant = checked("participant",
                    factory->create_participant(static_cast<uint32_t>(o.domain), qos, &watcher, StatusMask::none()));
    char hex[33];
    for (int i = 0; i < 16; ++i)
    {
        const rtps::GUID_t& guid = participant->guid();
        sprintf(hex + 2 * i, "%02x", i < 12 ? guid.guidPrefix.value[i] : guid.entityId.value[i - 12]);
    }
    say("GUID %s", hex);
    TypeSupport type(new SampleSupport(kind_of(&o)));
    type.register_type(participant);
    Topic* topic = checked("topic", participant->create_topic(o.topic, type.get_type_name(), TOPIC_QOS_DEFAULT));
    int status = o.is_publisher ? publish(participant, topic) : subscribe(participant, topic);
    participant->delete_contained_entities();
    factory->delete_participant(participant);
    return status;
}
