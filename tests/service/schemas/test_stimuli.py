from motionenv.data.stimuli import StimulusSet
from service.schemas.stimuli import StimuliRequest


def test_a_request_is_a_set_of_models_of_the_service():
    told, plain = StimuliRequest.model_json_schema(), StimulusSet.model_json_schema()
    assert set(told["properties"]) == set(plain["properties"])
    assert told["$defs"]["Walker"]["properties"]["model"]["pattern"]
    assert StimuliRequest().model_dump() == StimulusSet().model_dump()
